#include "core/base/build_id.h"

#include <cstddef>
#include <cstring>
#include <span>

#include <elf.h>
#include <link.h>

#include "core/base/text.h"

namespace core {

std::string linker_build_id() {
  std::string id;
  const auto visit = [](dl_phdr_info* object, std::size_t, void* result) -> int {
    for (int i = 0; i < object->dlpi_phnum; ++i) {
      const ElfW(Phdr)& segment = object->dlpi_phdr[i];
      if (segment.p_type != PT_NOTE) {
        continue;
      }
      const auto* begin =
          reinterpret_cast<const unsigned char*>(object->dlpi_addr + segment.p_vaddr);
      std::span<const unsigned char> notes(begin, segment.p_memsz);
      while (notes.size() >= sizeof(ElfW(Nhdr))) {
        ElfW(Nhdr) note;
        std::memcpy(&note, notes.data(), sizeof note);
        const std::size_t name_bytes = (note.n_namesz + 3U) & ~std::size_t{3};
        const std::size_t head_bytes = sizeof note + name_bytes;
        const std::size_t all_bytes = head_bytes + ((note.n_descsz + 3U) & ~std::size_t{3});
        if (all_bytes > notes.size()) {
          break;
        }
        if (note.n_type == NT_GNU_BUILD_ID) {
          *static_cast<std::string*>(result) = hex(notes.subspan(head_bytes, note.n_descsz));
          return 1;
        }
        notes = notes.subspan(all_bytes);
      }
    }
    return 1;  // the first object is the program itself
  };
  dl_iterate_phdr(visit, &id);
  return id;
}

}  // namespace core

/// Memory of large arrays of which little is in use at a time, such as textures: it lies in files
/// without names, so that the system can take the pages that are not read, and read them again when
/// they are.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

namespace core {

/// Arrays from this size on lie in files: the texels of 1448 x 1448, four bytes each. A judgement:
/// the smaller levels of 30 maps of 4096 x 4096 then stay in memory, which is 168 MB.
inline constexpr std::size_t kPagedBytes = std::size_t{8} << 20;

/// Returns the bytes that an array of so many takes for good: none in a file.
std::size_t resident_bytes(std::size_t bytes) noexcept;

/// Sets the folder of the files, on a disk with room for what is decoded. Without it they are in
/// $TMPDIR or /var/tmp. Where none can be made, the arrays are plain memory.
void set_paging_folder(std::string folder);

namespace paged_memory {

/// Returns zeroed memory. Throws: std::bad_alloc.
void* allocate(std::size_t bytes);
void release(void* p, std::size_t bytes) noexcept;
/// Takes the pages out of the process. They keep their contents.
void set_aside(const void* p, std::size_t bytes) noexcept;

}  // namespace paged_memory

/// An allocator of arrays that lie in files from kPagedBytes on.
template <typename T>
struct PagedAllocator {
  using value_type = T;  // NOLINT(readability-identifier-naming): the name of the standard
  PagedAllocator() = default;
  template <typename U>
  PagedAllocator(const PagedAllocator<U>& /*other*/) noexcept {}

  T* allocate(std::size_t count) {
    return is_paged(count) ? static_cast<T*>(paged_memory::allocate(count * sizeof(T)))
                           : std::allocator<T>().allocate(count);
  }
  void deallocate(T* p, std::size_t count) noexcept {
    if (is_paged(count)) {
      paged_memory::release(p, count * sizeof(T));
    } else {
      std::allocator<T>().deallocate(p, count);
    }
  }
  bool operator==(const PagedAllocator& /*other*/) const noexcept { return true; }

 private:
  static constexpr bool is_paged(std::size_t count) { return count >= kPagedBytes / sizeof(T); }
};

template <typename T>
using PagedVector = std::vector<T, PagedAllocator<T>>;

template <typename T>
std::size_t resident_bytes(const PagedVector<T>& values) noexcept {
  return resident_bytes(values.capacity() * sizeof(T));
}

/// Takes the pages of an array in a file out of the process, until they are read.
template <typename T>
void set_aside(const PagedVector<T>& values) noexcept {
  if (values.capacity() * sizeof(T) >= kPagedBytes) {
    paged_memory::set_aside(values.data(), values.capacity() * sizeof(T));
  }
}

}  // namespace core

// tessera-convert: files on stdin to a GLB on stdout (convert_protocol.h). Its only argument is the
// extension of the first file.
#include <cstdio>
#include <exception>
#include <new>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <unistd.h>

#include "core/base/descriptor.h"
#include "core/scene_io/assimp/confine.h"
#include "core/scene_io/assimp/read_model.h"
#include "core/scene_io/convert_protocol.h"

namespace {

std::vector<core::ModelFile> read_files() {
  std::vector<core::ModelFile> files;
  core::ConvertedFile head;
  while (core::read_all(STDIN_FILENO, &head, sizeof(head))) {
    core::ModelFile& file = files.emplace_back();
    file.name.resize(head.name_bytes);
    file.content.resize(head.bytes);
    if (!core::read_all(STDIN_FILENO, file.name.data(), file.name.size()) ||
        !core::read_all(STDIN_FILENO, file.content.data(), file.content.size())) {
      files.pop_back();
      break;
    }
  }
  return files;
}

void say(std::string_view begin, const std::string& text) {
  std::fprintf(stderr, "%.*s%s\n", static_cast<int>(begin.size()), begin.data(), text.c_str());
}

int convert(const std::string& extension) {
  std::vector<core::ModelFile> files = read_files();
  if (files.empty() || !core::confine()) {
    say(core::kErrorLine, files.empty() ? "no file" : "the system allows no seccomp filter");
    return 1;
  }
  const core::ReadModel model = core::read_model(extension, std::move(files));
  if (!model.fault.empty()) {  // before the notes: only so much is read
    say(core::kErrorLine, model.fault);
    return 1;
  }
  for (const std::string& note : model.notes) {
    say(core::kNoteLine, note);
  }
  return std::fwrite(model.glb.data(), 1, model.glb.size(), stdout) == model.glb.size() &&
                 std::fflush(stdout) == 0
             ? 0
             : 1;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return convert(argc > 1 ? argv[1] : "");
  } catch (const std::bad_alloc&) {
    return core::kNoMemory;
  } catch (const std::exception& error) {
    say(core::kErrorLine, error.what());
    return 1;
  }
}

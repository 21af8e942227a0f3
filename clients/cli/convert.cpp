// Files of other formats as GLB, without a server.
#include <cstdio>
#include <string>

#include "clients/cli/command.h"
#include "clients/cli/converted_model.h"
#include "clients/cli/files.h"
#include "clients/cli/shown.h"

namespace cli {
namespace {

constexpr const char* kVerb = "convert";

int run(const std::string& file, const std::string& output, const std::string& program) {
  core::Converters converters{.helper = core::find_converter()};
  if (!program.empty()) {
    converters.commands[core::extension_of_name(file)] = program;
  }
  const auto converted = convert_model(file, converters);
  if (!converted) {
    return complain(kVerb, converted.error());
  }
  for (const std::string& note : converted->notes) {
    std::fprintf(stderr, "note: %s\n", shown(note).c_str());
  }
  const std::string glb(reinterpret_cast<const char*>(converted->glb.data()),
                        converted->glb.size());
  const core::Status written = write_file(output, glb);
  return written ? kDone : complain(kVerb, written.error());
}

}  // namespace

int convert(const Args& args) {
  CLI::App app(
      "Converts STL, OBJ, PLY and 3MF to GLB, in a process without a network, with limits of "
      "memory and time. Prints which unit and which axis it assumed. Other formats need --program.",
      "tessera convert");
  std::string file;
  std::string output;
  std::string program;
  app.add_option("file", file, "A .stl, .obj, .ply or .3mf file")->required()->type_name("FILE");
  app.add_option("-o,--output", output, "GLB file; - is stdout")->required()->type_name("FILE");
  app.add_option(
         "--program", program,
         "Program that converts the file instead, called with it and the name of the GLB to "
         "write")
      ->type_name("PROGRAM");
  return parse_and_run(app, args, [&] { return run(file, output, program); });
}

}  // namespace cli

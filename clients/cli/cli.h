/// The command line: verbs that send requests to a server, and `render`, which needs none.
///
/// Every verb takes its arguments without the verb itself and returns the exit code: 0 success, 1
/// failure (including those of a file or the server), 2 wrong usage that the command line alone
/// shows. Results go to stdout, everything else to stderr.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "api/flags/exit_codes.h"

namespace cli {

using Args = std::vector<std::string>;

using flags::kDone;
using flags::kFailed;
using flags::kWrongUsage;

/// A verb of the program. run is null for verbs of the sibling program `tessera-server`.
struct Verb {
  std::string_view name;
  std::string_view summary;
  int (*run)(const Args& args);
};

/// Returns the table of verbs in the order of the help.
std::span<const Verb> verbs();

int submit(const Args& args);
int batch(const Args& args);
int watch(const Args& args);
int fetch(const Args& args);
int jobs(const Args& args);
int cancel(const Args& args);
int retry(const Args& args);
int show(const Args& args);
int pause_jobs(const Args& args);
int resume_jobs(const Args& args);
int extend(const Args& args);
int delete_jobs(const Args& args);
int upload(const Args& args);
int scenes(const Args& args);
int drain(const Args& args);
int merge(const Args& args);
int compare(const Args& args);
int meter(const Args& args);
int thumbnail(const Args& args);
int sign(const Args& args);
int mcp(const Args& args);
int health(const Args& args);
int completion(const Args& args);
int man(const Args& args);

/// Converts a file to GLB without a server; in the library cli_render.
int convert(const Args& args);
/// Denoises one image without a server. In the library cli_render, which links the renderer.
int denoise(const Args& args);
int render(const Args& args);
/// Runs an experiment of the estimator laboratory; in the same library.
int lab_command(const Args& args);
/// Renders units of a server's jobs; in the same library.
int worker(const Args& args);

}  // namespace cli

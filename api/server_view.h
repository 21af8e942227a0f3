/// GET /v1/server: what this build and this server can do, from the registries.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "api/json.h"

namespace api {

struct NamedSummary {
  std::string name;
  std::string summary;
};

struct FormatView {
  std::string extension;  ///< "png"
  std::string mime;       ///< "image/png"
};

/// What the API tells about other parts of the program; handed in, so that nobody who only parses
/// requests has to link them.
struct Capabilities {
  std::vector<NamedSummary> scenes;       ///< core::builtin_scenes()
  std::vector<FormatView> image_formats;  ///< core::image_formats()
  std::vector<std::string> tone_maps;     ///< core::tone_maps()
  std::vector<std::string> extensions;    ///< of glTF
};

struct BuildView {
  std::string id;
  std::string commit;
  std::string compiler;
  std::string isa;  ///< that Embree traces with
  std::string embree;
  bool waves = false;           ///< core::waves_serve()
  std::string arithmetic = {};  ///< core::arithmetic_class(); written into pictures and films
};

/// A maximum that the operator chose: name and value join the table of api/limits.h.
struct ConfiguredLimit {
  std::string name;
  std::int64_t value = 0;
};

/// Whether the server takes new jobs, and what it still has.
struct DrainView {
  bool draining = false;
  int running = 0;  ///< load, render or end
  int queued = 0;
};
std::string drain_json(const DrainView& drain);

struct ServerView {
  std::string version;
  BuildView build;
  Capabilities capabilities;
  std::vector<ConfiguredLimit> limits;
};
/// `build` of server_json() with the arithmetic class: what goes with films and pictures.
std::string build_json(const ServerView& server);
std::string server_json(const ServerView& server);

/// A switch of the estimation that is not an integrator, sampler, light sampler or adaptive rule.
struct OptionRow {
  std::string name;  ///< "estimator.mis.balance"
  std::string bias;  ///< none, consistent, biased
  std::string summary;
  std::string patch;  ///< RFC 7396 merge patch of the job request that turns it on, as JSON text
};
std::vector<OptionRow> estimation_options();

}  // namespace api

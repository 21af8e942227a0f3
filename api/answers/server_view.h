/// GET /v1/server: capabilities of this build and server, from the registries.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "api/json/json.h"

namespace api {

struct NamedSummary {
  std::string name;
  std::string summary;
};

struct FormatView {
  std::string extension;  ///< "png"
  std::string mime;       ///< "image/png"
};

/// Facts about other parts of the program; passed in, so that programs that only parse requests
/// need not link them.
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
  std::string isa;  ///< instruction set of Embree
  std::string embree;
  bool waves = false;           ///< core::waves_serve()
  std::string arithmetic = {};  ///< core::arithmetic_class(); written into pictures and films
};

/// A limit set by the operator; added to the table of api/json/limits.h.
struct ConfiguredLimit {
  std::string name;
  std::int64_t value = 0;
};

/// Whether the server accepts new jobs, and its remaining work.
struct DrainView {
  bool draining = false;
  int running = 0;  ///< loading, rendering or ending
  int queued = 0;
};
std::string drain_json(const DrainView& drain);

struct ServerView {
  std::string version;
  BuildView build;
  Capabilities capabilities;
  std::vector<ConfiguredLimit> limits;
};
/// Returns `build` of server_json() with the arithmetic class, as stored in films and images.
std::string build_json(const ServerView& server);
std::string server_json(const ServerView& server);

/// An estimator setting other than integrator, sampler, light sampler and adaptive rule.
struct OptionRow {
  std::string name;  ///< "estimator.mis.balance"
  std::string bias;  ///< none, consistent, biased
  std::string summary;
  std::string patch;  ///< RFC 7396 merge patch of the job request that selects it, as JSON text
};
std::vector<OptionRow> estimation_options();

}  // namespace api

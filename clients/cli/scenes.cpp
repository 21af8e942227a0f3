// The verbs for uploads: upload, scenes.
#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

#include "clients/cli/api_client.h"
#include "clients/cli/command.h"
#include "clients/cli/files.h"
#include "clients/cli/job_json.h"
#include "clients/cli/shown.h"
#include "clients/cli/upload.h"
#include "core/base/file_names.h"

namespace cli {
namespace {

using core::Error;
using core::ErrorCode;

constexpr int kPage = 200;

/// Uploads a model as a scene, any other file as an asset.
core::Result<std::string> upload_file(ApiClient& client, const std::string& path, bool is_strict) {
  const auto model = model_file(path);
  if (!model) {
    return model.error();
  }
  if (!*model) {
    return Error{ErrorCode::kNotFound, "there is no such file", path};
  }
  return is_model(**model) ? upload_scene(client, **model, is_strict)
                           : upload_asset(client, **model);
}

int upload_files(const ServerFlags& server, const std::vector<std::string>& files, bool is_strict) {
  auto client = ApiClient::connect(server.url, server.key);
  if (!client) {
    return complain("upload", client.error());
  }
  int code = kDone;
  for (const std::string& file : files) {
    const auto id = upload_file(**client, file, is_strict);
    if (id) {
      std::printf("%s\n", id->c_str());
    } else {
      code = complain("upload", id.error());
    }
  }
  return code;
}

/// Returns the built-in scenes in the form of the others.
core::Result<Json> built_in_scenes(ApiClient& client) {
  const auto reply = client.get("/v1/server");
  if (!reply) {
    return reply.error();
  }
  Json about = parse_object(reply->body);
  Json scenes = Json::array();
  for (const Json& scene : about.contains("scenes") ? about["scenes"] : Json::array()) {
    scenes.push_back(Json{{"id", text_at(scene, "name")}, {"name", text_at(scene, "summary")}});
  }
  return scenes;
}

core::Result<Json> all_scenes(ApiClient& client, int limit) {
  auto all = built_in_scenes(client);
  if (!all) {
    return all.error();
  }
  std::string cursor;
  int left = limit;
  do {
    std::string path = "/v1/scenes?limit=" + std::to_string(std::min(left, kPage));
    path += cursor.empty() ? "" : "&cursor=" + core::percent_encode(cursor);
    const auto reply = client.get(path);
    if (!reply) {
      return reply.error();
    }
    Json page = parse_object(reply->body);
    for (Json& scene : page["scenes"]) {
      all->push_back(std::move(scene));
      --left;
    }
    cursor = text_at(page, "next");
  } while (!cursor.empty() && left > 0);
  return all;
}

int list_scenes(const ServerFlags& server, int limit, bool as_json) {
  auto client = ApiClient::connect(server.url, server.key);
  const auto all = client ? all_scenes(**client, limit) : core::Result<Json>(client.error());
  if (!all) {
    return complain("scenes", all.error());
  }
  if (as_json) {
    std::printf("%s\n", Json{{"scenes", *all}}.dump(2).c_str());
    return kDone;
  }
  for (const Json& scene : *all) {
    std::printf("%s  %s\n", text_at(scene, "id").c_str(), shown(text_at(scene, "name")).c_str());
  }
  return kDone;
}

}  // namespace

int upload(const Args& args) {
  CLI::App app(
      "Uploads models (.glb, .gltf with its files, .zip, or a folder) and environment maps (.hdr, "
      ".exr), and prints their ids.",
      "tessera upload");
  ServerFlags server;
  std::vector<std::string> files;
  bool is_strict = false;
  app.add_option("file", files, "Files")->required()->type_name("FILE...");
  app.add_flag("--strict", is_strict,
               "Refuse models with faults, which are otherwise mended with a warning");
  add_server_flags(app, server);
  return parse_and_run(app, args, [&] { return upload_files(server, files, is_strict); });
}

int scenes(const Args& args) {
  CLI::App app("Lists the scenes of a server: the built-in ones, then uploads, newest first.",
               "tessera scenes");
  ServerFlags server;
  int limit = 100;
  bool as_json = false;
  app.add_option("--limit", limit, "Maximum number of uploads to list")
      ->check(CLI::Range(1, 100000).description(""))
      ->type_name("N")
      ->capture_default_str();
  app.add_flag("--json", as_json, "Print the scenes as JSON");
  add_server_flags(app, server);
  return parse_and_run(app, args, [&] { return list_scenes(server, limit, as_json); });
}

}  // namespace cli

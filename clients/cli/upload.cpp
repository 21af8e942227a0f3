#include "clients/cli/upload.h"

#include "clients/cli/files.h"
#include "clients/cli/job_json.h"

namespace cli {
namespace {

using core::Error;
using core::ErrorCode;

core::Result<std::string> upload_bytes(ApiClient& client, const std::string& bytes) {
  std::string id = sha256_hex(bytes);
  const std::string path = "/v1/assets/" + id;
  const auto known = client.head(path);
  if (!known) {
    return known.error();
  }
  if (*known == 200) {
    return id;
  }
  const auto reply = client.put(path, bytes, "application/octet-stream");
  if (!reply) {
    return reply.error();
  }
  return id;
}

core::Result<std::string> scene_id_of(const core::Result<Reply>& reply) {
  if (!reply) {
    return reply.error();
  }
  std::string id = text_at(parse_object(reply->body), "id");
  if (id.empty()) {
    return Error{ErrorCode::kInternal, "the server's response contains no scene id", ""};
  }
  return id;
}

/// Adds the file's name for lists of scenes.
std::string scenes_path(const std::string& file) {
  return "/v1/scenes?name=" + encode_url(file.substr(file.find_last_of('/') + 1));
}

core::Result<std::string> upload_gltf(ApiClient& client, const std::string& path,
                                      const std::string& document) {
  const auto uris = gltf_side_files(document);
  if (!uris) {
    return Error{uris.error().code, uris.error().message, path};
  }
  Json request = {{"gltf", ""}, {"files", Json::object()}};
  for (const std::string& uri : *uris) {
    const auto file = side_file_path(folder_of(path), uri);
    if (!file) {
      return file.error();
    }
    auto id = upload_asset(client, *file);
    if (!id) {
      return id.error();
    }
    request["files"][uri] = *id;
  }
  auto id = upload_bytes(client, document);
  if (!id) {
    return id.error();
  }
  request["gltf"] = *id;
  return scene_id_of(client.post(scenes_path(path), request.dump(), "application/json"));
}

}  // namespace

core::Result<std::string> upload_asset(ApiClient& client, const std::string& path) {
  const auto bytes = read_file(path);
  if (!bytes) {
    return bytes.error();
  }
  return upload_bytes(client, *bytes);
}

core::Result<std::string> upload_scene(ApiClient& client, const std::string& path) {
  const auto bytes = read_file(path);
  if (!bytes) {
    return bytes.error();
  }
  const std::string extension = extension_of(path);
  if (extension == "gltf") {
    return upload_gltf(client, path, *bytes);
  }
  const bool zip = extension == "zip";
  if (!zip && extension != "glb") {
    return Error{ErrorCode::kUnsupportedFormat, "a scene must be a .glb, .gltf or .zip file", path};
  }
  return scene_id_of(
      client.post(scenes_path(path), *bytes, zip ? "application/zip" : "model/gltf-binary"));
}

}  // namespace cli

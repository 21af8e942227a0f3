#include "clients/cli/upload.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "clients/cli/files.h"
#include "clients/cli/job_json.h"
#include "clients/cli/model_files.h"
#include "clients/cli/shown.h"
#include "core/base/file_names.h"
#include "core/base/sha256.h"
#include "core/base/zip_writer.h"

namespace cli {
namespace {

using core::Error;
using core::ErrorCode;

constexpr std::array<std::pair<std::string_view, std::string_view>, 7> kMedia = {
    {{"glb", "model/gltf-binary"},
     {"gltf", "model/gltf+json"},
     {"zip", "application/zip"},
     {"stl", "model/stl"},
     {"obj", "model/obj"},
     {"ply", "model/ply"},
     {"3mf", "model/3mf"}}};

core::Result<std::string> upload_bytes(ApiClient& client, const std::string& bytes) {
  std::string id = core::sha256_hex(bytes.data(), bytes.size());
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
  const Json scene = parse_object(reply->body);
  std::string id = text_at(scene, "id");
  tell_warnings(scene);
  if (id.empty()) {
    return Error{ErrorCode::kInternal, "the server's response contains no scene id", ""};
  }
  return id;
}

/// Adds the file's name for lists of scenes.
std::string scenes_path(const std::string& file, bool is_strict) {
  return "/v1/scenes?name=" + core::percent_encode(file.substr(file.find_last_of('/') + 1)) +
         (is_strict ? "&strict=1" : "");
}

/// Sends the files beside a document that the server asks for, until it asks for no more.
core::Result<std::string> upload_with_files(ApiClient& client, const std::string& path,
                                            const std::string& document,
                                            std::vector<std::string> missing, bool is_strict) {
  const auto gltf = upload_bytes(client, document);
  if (!gltf) {
    return gltf.error();
  }
  Json request = {{"gltf", *gltf}, {"files", Json::object()}};
  while (true) {
    for (const std::string& name : missing) {
      const auto file = side_file_path(folder_of(path), name);
      if (!file) {
        return file.error();
      }
      const auto id = upload_asset(client, *file);
      if (!id) {
        return id.error();
      }
      request["files"][name] = *id;
    }
    const auto reply =
        client.post(scenes_path(path, is_strict), request.dump(), "application/json");
    missing = client.last().missing;
    const bool is_asked_again = std::any_of(
        missing.begin(), missing.end(),
        [&request](const std::string& name) { return request["files"].contains(name); });
    if (missing.empty() || is_asked_again) {
      return scene_id_of(reply);
    }
  }
}

std::string zip_of(const std::vector<NamedFile>& files) {
  core::ZipWriter zip;
  std::string archive;
  for (const NamedFile& file : files) {
    archive.append(zip.begin_entry(file.name, file.content)).append(file.content);
  }
  return archive + zip.end();
}

std::optional<std::string_view> media_of(std::string_view extension) {
  const auto* const media = std::find_if(kMedia.begin(), kMedia.end(),
                                         [&](const auto& row) { return row.first == extension; });
  return media == kMedia.end() ? std::nullopt : std::optional(media->second);
}

}  // namespace

bool is_model(const std::string& path) { return media_of(extension_of(path)).has_value(); }

void tell_warnings(const Json& described, const Json& known) {
  if (const auto found = described.find("warnings");
      found != described.end() && found->is_array()) {
    for (const Json& warning : *found) {
      if (std::find(known.begin(), known.end(), warning) != known.end()) {
        continue;
      }
      std::fprintf(stderr, "warning: %s\n",
                   shown(warning.is_string() ? warning.get<std::string>() : "").c_str());
    }
  }
}

core::Result<std::string> upload_asset(ApiClient& client, const std::string& path) {
  const auto bytes = read_file(path);
  if (!bytes) {
    return bytes.error();
  }
  return upload_bytes(client, *bytes);
}

core::Result<std::string> upload_scene(ApiClient& client, const std::string& path, bool is_strict) {
  auto files = read_model_files(path);
  if (!files) {
    return files.error();
  }
  const std::string extension = files->size() > 1 ? "zip" : extension_of(path);
  const std::string body = files->size() > 1 ? zip_of(*files) : std::move(files->front().content);
  // The server may have a program for any other format.
  const std::string_view media = media_of(extension).value_or("application/octet-stream");
  const auto reply = client.post(scenes_path(path, is_strict), body, std::string(media));
  const std::vector<std::string> missing = client.last().missing;
  return missing.empty() || extension == "zip"
             ? scene_id_of(reply)
             : upload_with_files(client, path, body, missing, is_strict);
}

}  // namespace cli

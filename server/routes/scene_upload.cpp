#include "server/routes/scene_upload.h"

#include <algorithm>
#include <cstddef>
#include <string>
#include <utility>

#include "api/json/errors.h"
#include "api/json/json.h"
#include "core/scene_io/gltf_uri.h"
#include "server/routes/answers.h"

namespace server {

namespace {

/// The answer to a client that has sent these names the next ones.
constexpr std::size_t kMissingShown = 1000;

}  // namespace

core::Result<SceneService::Upload> read_body(const RouteContext& context, const Request& request) {
  constexpr std::uint64_t kFirst = std::uint64_t{64} << 10U;
  const auto declared = request.body_reader->declared_bytes();
  auto lease = context.memory.take(
      {.bytes = declared.value_or(kFirst), .tenant = request.access.tenant}, "the upload");
  if (!lease) {
    return lease.error();
  }
  core::Bytes content;
  // Reserves address space; the system allocates pages as the content arrives.
  content.reserve(static_cast<std::size_t>(declared.value_or(kFirst)));
  core::Status room = core::ok_status();
  const bool complete = request.body_reader->read([&](std::string_view piece) {
    if (content.size() + piece.size() > content.capacity()) {
      // Doubles the buffer for a body of unknown length; both buffers exist while the content is
      // moved.
      const std::uint64_t before = content.capacity();
      const std::uint64_t next = std::max<std::uint64_t>(2 * before, content.size() + piece.size());
      room = lease->grow(next);
      if (!room) {
        return false;
      }
      content.reserve(static_cast<std::size_t>(next));
      lease->shrink_to(next);
    }
    const auto* bytes = reinterpret_cast<const std::byte*>(piece.data());
    content.insert(content.end(), bytes, bytes + piece.size());
    return true;
  });
  if (!room) {
    return room.error();
  }
  if (!complete) {
    return body_cut_short();
  }
  return SceneService::Upload(std::move(content), *std::move(lease));
}

std::string format_of(std::string_view type, std::string_view name) {
  constexpr std::string_view kModel = "model/";
  if (type.starts_with("model/gltf")) {
    return "";
  }
  if (type.starts_with(kModel)) {
    return std::string(type.substr(kModel.size()));
  }
  const bool is_any = type.empty() || type == "application/octet-stream";
  return is_any ? core::extension_of_name(name) : "";
}

std::optional<Response> refused_scene(const Request& request,
                                      const core::Result<SceneService::Added>& added) {
  if (!added) {
    return error_answer(request, added.error());
  }
  if (added->missing.empty()) {
    return std::nullopt;
  }
  api::Problem problem = api::from_error(core::missing_files(added->missing, added->outside));
  for (std::size_t i = 0; i < added->missing.size(); ++i) {
    const std::string& name = added->missing[i];
    if (problem.errors.size() == kMissingShown) {
      break;
    }
    constexpr std::size_t kNameShown = 1024;  // No client has a file of a longer name.
    if (name.size() > kNameShown) {
      continue;
    }
    const bool is_outside =
        std::find(added->outside.begin(), added->outside.end(), name) != added->outside.end();
    problem.errors.push_back(
        {api::join_pointer("/files", name),
         (is_outside ? "lies outside the folder of the scene" : "is missing") + added->near[i]});
  }
  return problem_answer(request, problem);
}

}  // namespace server

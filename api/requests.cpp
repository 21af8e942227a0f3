#include "api/requests.h"

#include <algorithm>

#include "api/job/job_checks.h"
#include "api/job/job_rows.h"
#include "api/job/stop_rules.h"
#include "api/json/fields.h"
#include "api/json/limits.h"
#include "api/json/schemas.h"

namespace api {
namespace {

struct PatchBody {
  JobSpec spec;
  std::optional<bool> paused;
};

void read_labels_patch(const Json& value, PatchBody& out, const std::string& pointer,
                       Faults& faults) {
  if (!expect_object(value, pointer, faults)) {
    return;
  }
  Json merged;
  print_labels(out.spec, merged);
  merged["labels"].merge_patch(value);
  read_labels(merged["labels"], out.spec, pointer, faults);
}

void read_stop_patch(const Json& value, PatchBody& out, const std::string& pointer,
                     Faults& faults) {
  if (!expect_object(value, pointer, faults)) {
    return;
  }
  // Refused here because merging would silently drop an unknown field that is null.
  refuse_unknown_members(value, stop_member_names(), pointer, faults);
  Json merged = print_stop(out.spec.stop);
  merged.merge_patch(value);
  if (merged.contains("scope") && !merged.contains("relative_error") && !value.contains("scope")) {
    merged.erase("scope");  // removed together with its rule
  }
  out.spec.stop = read_stop(merged, pointer, faults);
}

void read_paused(const Json& value, PatchBody& out, const std::string& pointer, Faults& faults) {
  out.paused = read_flag(value, pointer, faults);
}

const auto& patch_table() {
  static constexpr auto kTable = std::tuple{
      number(
          "priority", [](auto& s) -> auto& { return s.spec.priority; },
          {-limits::kPriority, limits::kPriority}, "Higher values are served first."),
      CustomRow<PatchBody>{"labels", &read_labels_patch, [](const PatchBody&, Json&) {},
                           [](const PatchBody& defaults) {
                             Json schema = labels_schema(defaults.spec);
                             schema["description"] =
                                 "Labels to set; null removes one, others are kept.";
                             schema["additionalProperties"]["type"] = {"string", "null"};
                             return schema;
                           }},
      text(
          "name", [](auto& s) -> auto& { return s.spec.name; }, {0, limits::kNameCharacters},
          "Display name."),
      CustomRow<PatchBody>{"stop", &read_stop_patch, [](const PatchBody&, Json&) {},
                           [](const PatchBody& defaults) {
                             Json schema = stop_schema(defaults.spec.stop);
                             schema["description"] =
                                 "Rules to change; null removes one, others are kept.";
                             schema.erase("minProperties");
                             return schema;
                           }},
      CustomRow<PatchBody>{
          "paused", &read_paused, [](const PatchBody&, Json&) {},
          [](const PatchBody&) { return basic_schema("boolean", "True pauses, false resumes."); }},
  };
  return kTable;
}

struct ExtendBody {
  core::StopRules stop;
};

const auto& extend_table() {
  static constexpr auto kTable = std::tuple{
      CustomRow<ExtendBody>{
          "stop",
          [](const Json& value, ExtendBody& out, const std::string& pointer, Faults& faults) {
            out.stop = read_stop(value, pointer, faults);
          },
          [](const ExtendBody& body, Json& object) { object["stop"] = print_stop(body.stop); },
          [](const ExtendBody&) {
            Json schema = stop_schema({});
            schema["description"] = "The new rules; they replace the old ones.";
            schema.erase("default");
            return schema;
          },
          true},
  };
  return kTable;
}

void read_asset_id(const Json& value, std::string& out, const std::string& pointer,
                   Faults& faults) {
  if (!value.is_string()) {
    faults.add(pointer, "expected a string, got " + std::string(type_text(value)));
  } else if (const auto& id = value.get_ref<const std::string&>(); !is_sha256(id)) {
    faults.add(pointer, shown(value) + " is not an asset id (64 lower-case hex digits)");
  } else {
    out = id;
  }
}

Json asset_id_schema(std::string_view doc) {
  Json schema = basic_schema("string", doc);
  schema["pattern"] = "^[0-9a-f]{64}$";
  return schema;
}

void read_files(const Json& value, SceneFromAssets& out, const std::string& pointer,
                Faults& faults) {
  if (!expect_object(value, pointer, faults)) {
    return;
  }
  if (value.size() > static_cast<std::size_t>(limits::kSceneFiles)) {
    faults.add_too_large(pointer, "names " + std::to_string(value.size()) + " files; at most " +
                                      std::to_string(limits::kSceneFiles) + " are allowed");
    return;
  }
  for (const auto& member : value.items()) {
    const std::string place = join_pointer(pointer, member.key());
    if (member.key().empty()) {
      faults.add(place, "the uri is empty");
    } else {
      read_asset_id(member.value(), out.files[member.key()], place, faults);
    }
  }
}

const auto& scene_table() {
  static constexpr auto kTable = std::tuple{
      CustomRow<SceneFromAssets>{
          "gltf",
          [](const Json& value, SceneFromAssets& out, const std::string& pointer, Faults& faults) {
            read_asset_id(value, out.gltf, pointer, faults);
          },
          [](const SceneFromAssets& body, Json& object) { object["gltf"] = body.gltf; },
          [](const SceneFromAssets&) {
            return asset_id_schema("Asset with the glTF or GLB file.");
          },
          true},
      CustomRow<SceneFromAssets>{
          "files", &read_files,
          [](const SceneFromAssets& body, Json& object) { object["files"] = body.files; },
          [](const SceneFromAssets&) {
            Json schema = basic_schema("object", "Asset id of each uri in the glTF.");
            schema["additionalProperties"] = asset_id_schema("");
            schema["maxProperties"] = limits::kSceneFiles;
            schema["default"] = Json::object();
            return schema;
          }},
  };
  return kTable;
}

bool is_job_or_asset(const std::string& id) { return is_uuid(id) || is_sha256(id); }

constexpr std::string_view kIdDoc = "Job id (UUID) or asset id (64 hex digits).";

void check_id(const std::string& id, const std::string& pointer, Faults& faults) {
  if (!is_job_or_asset(id)) {
    faults.add(pointer,
               shown(Json(id)) + " is neither a job id (UUID) nor an asset id (64 hex digits)");
  }
}

void check_denoise(const std::string& id, DenoiseShow denoise, const std::string& pointer,
                   Faults& faults) {
  if (denoise != DenoiseShow::kOff && !is_uuid(id)) {
    faults.add(pointer, "applies only to jobs");
  }
}

const auto& comparison_table() {
  static constexpr auto kTable = std::tuple{
      required_text("a", &ComparisonRequest::a, {1, 64}, kIdDoc),
      required_text("b", &ComparisonRequest::b, {1, 64}, kIdDoc),
      choice(
          "a_denoise", &ComparisonRequest::a_denoise, &denoise_shows,
          "Which image of job a. For a denoised image the errors of individual pixels are unknown, "
          "so bias.low, bias.high and z are null."),
      choice("b_denoise", &ComparisonRequest::b_denoise, &denoise_shows, "Which image of job b."),
  };
  return kTable;
}

void read_films(const Json& value, MergeRequest& out, const std::string& pointer, Faults& faults) {
  if (!value.is_array()) {
    faults.add(pointer, "expected an array, got " + std::string(type_text(value)));
    return;
  }
  if (value.empty() || value.size() > static_cast<std::size_t>(limits::kMergeFilms)) {
    faults.add(pointer, "has " + std::to_string(value.size()) + " elements, outside [1, " +
                            std::to_string(limits::kMergeFilms) + "]");
    return;
  }
  for (std::size_t i = 0; i < value.size(); ++i) {
    const std::string place = join_pointer(pointer, std::to_string(i));
    const auto id = read_text(value[i], {1, 64}, place, faults);
    if (!id) {
      continue;
    }
    check_id(*id, place, faults);
    if (std::find(out.films.begin(), out.films.end(), *id) != out.films.end()) {
      faults.add(place, shown(value[i]) + " appears more than once");
    }
    out.films.push_back(*id);
  }
}

const auto& merge_table() {
  static constexpr auto kTable = std::tuple{
      CustomRow<MergeRequest>{
          "films", &read_films,
          [](const MergeRequest& body, Json& object) { object["films"] = body.films; },
          [](const MergeRequest&) {
            Json schema = basic_schema("array", "Compatible films that share no samples.");
            schema["items"] = basic_schema("string", kIdDoc);
            schema["minItems"] = 1;
            schema["maxItems"] = limits::kMergeFilms;
            schema["uniqueItems"] = true;
            return schema;
          },
          true},
  };
  return kTable;
}

void read_watched_jobs(const Json& value, TicketRequest& out, const std::string& pointer,
                       Faults& faults) {
  if (!value.is_array() || value.empty() ||
      value.size() > static_cast<std::size_t>(limits::kWatchedJobs)) {
    faults.add(pointer, "expected an array of 1 to " + std::to_string(limits::kWatchedJobs) +
                            " job ids, got " + std::string(type_text(value)));
    return;
  }
  for (std::size_t i = 0; i < value.size(); ++i) {
    const std::string place = join_pointer(pointer, std::to_string(i));
    const auto id = read_text(value[i], {1, 64}, place, faults);
    if (!id || !expect_uuid(*id, "job", place, faults)) {
      continue;
    }
    if (std::find(out.jobs.begin(), out.jobs.end(), *id) != out.jobs.end()) {
      faults.add(place, shown(value[i]) + " appears more than once");
    } else {
      out.jobs.push_back(*id);
    }
  }
}

const auto& ticket_table() {
  static constexpr auto kTable = std::tuple{
      CustomRow<TicketRequest>{
          "jobs", &read_watched_jobs,
          [](const TicketRequest& body, Json& object) { object["jobs"] = body.jobs; },
          [](const TicketRequest&) {
            Json schema = basic_schema("array", "Jobs that the ticket's bearer may watch.");
            schema["items"] = basic_schema("string", "Job id (UUID).");
            schema["items"]["format"] = "uuid";
            schema["minItems"] = 1;
            schema["maxItems"] = limits::kWatchedJobs;
            schema["uniqueItems"] = true;
            return schema;
          },
          true},
  };
  return kTable;
}

}  // namespace

Parsed<JobPatch> parse_job_patch(std::string_view body, const JobSpec& current) {
  const Parsed<Json> value = parse_json(body, limits::kBodyBytes);
  if (!value) {
    return value.problem();
  }
  PatchBody patched{current, {}};
  Faults faults;
  read_members(patch_table(), *value, patched, "", faults);
  JobPatch patch;
  if (faults.empty() && value->contains("stop")) {
    patch.stop_named = true;
    check_error_target(patched.spec.stop, patched.spec, faults);
    round_stop(patched.spec.stop, patched.spec.render, patch.warnings);
  }
  if (!faults.empty()) {
    return faults.problem();
  }
  patch.spec = std::move(patched.spec);
  patch.paused = patched.paused;
  return patch;
}

Parsed<ExtendRequest> parse_extend(std::string_view body, const JobSpec& current) {
  Parsed<ExtendBody> parsed = parse_body(extend_table(), body, ExtendBody{});
  if (!parsed) {
    return parsed.problem();
  }
  ExtendRequest request{parsed->stop, {}};
  Faults faults;
  check_error_target(request.stop, current, faults);
  round_stop(request.stop, current.render, request.warnings);
  if (!faults.empty()) {
    return faults.problem();
  }
  return request;
}

Parsed<SceneFromAssets> parse_scene_from_assets(std::string_view body) {
  return parse_body(scene_table(), body, SceneFromAssets{});
}

Parsed<ComparisonRequest> parse_comparison(std::string_view body) {
  Parsed<ComparisonRequest> parsed = parse_body(comparison_table(), body, ComparisonRequest{});
  if (parsed) {
    Faults faults;
    check_id(parsed->a, "/a", faults);
    check_id(parsed->b, "/b", faults);
    check_denoise(parsed->a, parsed->a_denoise, "/a_denoise", faults);
    check_denoise(parsed->b, parsed->b_denoise, "/b_denoise", faults);
    if (!faults.empty()) {
      return faults.problem();
    }
  }
  return parsed;
}

Parsed<MergeRequest> parse_merge(std::string_view body) {
  return parse_body(merge_table(), body, MergeRequest{});
}

Parsed<TicketRequest> parse_ticket(std::string_view body) {
  return parse_body(ticket_table(), body, TicketRequest{});
}

Json job_patch_schema() {
  Json schema = object_schema(patch_table(), PatchBody{},
                              "A merge patch (RFC 7396) of the changeable members.");
  for (auto& property : schema["properties"]) {
    property.erase("default");
  }
  return schema;
}
Json extend_schema() {
  return object_schema(extend_table(), ExtendBody{}, "New stop rules for a finished job.");
}
Json scene_from_assets_schema() {
  return object_schema(scene_table(), SceneFromAssets{}, "A scene from uploaded assets.");
}
Json comparison_request_schema() {
  return object_schema(comparison_table(), ComparisonRequest{}, "Two images; b is the reference.");
}
Json ticket_request_schema() {
  return object_schema(ticket_table(), TicketRequest{}, "Jobs for which to create a ticket.");
}
Json merge_schema() { return object_schema(merge_table(), MergeRequest{}, "Films to merge."); }

}  // namespace api

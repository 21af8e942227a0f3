#include "api/batch.h"

#include <algorithm>
#include <set>
#include <utility>

#include "api/job/job_rows.h"
#include "api/json/errors.h"
#include "api/json/fields.h"
#include "api/json/limits.h"
#include "api/json/schemas.h"
#include "api/json/values.h"

namespace api {
namespace {

/// The members of the body.
struct Body {
  Json job_template;
  Json matrix;
  std::string name;
  JobSpec with_webhook;  ///< only its webhook is used
};

void read_matrix(const Json& value, Body& out, const std::string& pointer, Faults& faults) {
  if (!expect_object(value, pointer, faults)) {
    return;
  }
  if (value.empty()) {
    faults.add(pointer, "expected at least one member");
  }
  std::int64_t jobs = 1;
  for (const auto& member : value.items()) {
    const std::string place = join_pointer(pointer, member.key());
    const Json& values = member.value();
    if (!values.is_array() || values.empty()) {
      faults.add(place, "expected an array of at least one value");
    } else {
      jobs *= std::min(static_cast<std::int64_t>(values.size()), limits::kBatchJobs + 1);
      jobs = std::min(jobs, limits::kBatchJobs + 1);
    }
    if (("." + member.key() + ".").find("..") != std::string::npos) {
      faults.add(place, "is not the path of a member, such as camera.orbit.theta_degrees");
    }
  }
  if (jobs > limits::kBatchJobs) {
    faults.add(pointer, "makes more than " + std::to_string(limits::kBatchJobs) + " jobs");
  }
  out.matrix = value;
}

Json matrix_schema(const Body& /*defaults*/) {
  Json schema = basic_schema(
      "object",
      "Paths of members of the job request, each with an array of values: {\"variant\": [\"a\", "
      "\"b\"]}. Every combination is a job; the last member changes fastest. Values that are "
      "objects are merged into the member. At most `batch_jobs` jobs.");
  schema["minProperties"] = 1;
  schema["additionalProperties"] = {{"type", "array"}, {"items", Json::object()}, {"minItems", 1}};
  return schema;
}

const auto& batch_table() {
  static constexpr auto kTable = std::tuple{
      CustomRow<Body>{
          "template",
          [](const Json& value, Body& out, const std::string& pointer, Faults& faults) {
            if (expect_object(value, pointer, faults)) {
              out.job_template = value;
            }
          },
          [](const Body& body, Json& object) { object["template"] = body.job_template; },
          [](const Body&) {
            return basic_schema(
                "object",
                "A JobRequest; members that the matrix sets may be missing. Class normal only.");
          },
          true},
      CustomRow<Body>{"matrix", &read_matrix,
                      [](const Body& body, Json& object) { object["matrix"] = body.matrix; },
                      &matrix_schema, true},
      text("name", &Body::name, {0, limits::kNameCharacters},
           "Pattern of the jobs' names. {variant} is replaced by the value of a member, given by "
           "its path or the last part of it; {index} counts from 1. Empty: the values of the "
           "matrix."),
      CustomRow<Body>{
          "webhook",
          [](const Json& value, Body& out, const std::string& pointer, Faults& faults) {
            read_webhook(value, out.with_webhook, pointer, faults);
          },
          [](const Body& body, Json& object) { print_webhook(body.with_webhook, object); },
          [](const Body&) {
            Json schema = webhook_schema(JobSpec{});
            schema["description"] = "One call when all jobs have ended; `events` has no effect.";
            return schema;
          }},
  };
  return kTable;
}

/// A key of the matrix.
struct Axis {
  std::string key;
  std::vector<std::string> path;
  const Json& values;

  std::string pointer() const {
    std::string text;
    for (const std::string& part : path) {
      text = join_pointer(text, part);
    }
    return text;
  }
};

std::vector<std::string> split_path(const std::string& key) {
  std::vector<std::string> parts;
  std::size_t start = 0;
  for (std::size_t dot = key.find('.'); dot != std::string::npos; dot = key.find('.', start)) {
    parts.push_back(key.substr(start, dot - start));
    start = dot + 1;
  }
  parts.push_back(key.substr(start));
  return parts;
}

std::vector<Axis> axes_of(const Json& matrix) {
  std::vector<Axis> axes;
  for (const auto& member : matrix.items()) {
    axes.push_back({member.key(), split_path(member.key()), member.value()});
  }
  return axes;
}

/// Returns the index of the job's value on each axis; the last axis changes fastest.
std::vector<std::size_t> choices_of(const std::vector<Axis>& axes, std::size_t job) {
  std::vector<std::size_t> choices(axes.size());
  for (std::size_t i = axes.size(); i-- > 0;) {
    choices[i] = job % axes[i].values.size();
    job /= axes[i].values.size();
  }
  return choices;
}

void put(Json& job, const std::vector<std::string>& path, const Json& value) {
  Json* at = &job;
  for (const std::string& part : path) {
    if (!at->is_object()) {
      *at = Json::object();
    }
    at = &(*at)[part];
  }
  if (value.is_object()) {
    at->merge_patch(value);
  } else {
    *at = value;
  }
}

const Json* member_at(const Json& job, const std::vector<std::string>& path) {
  const Json* at = &job;
  for (const std::string& part : path) {
    const auto found = at->is_object() ? at->find(part) : at->end();
    if (!at->is_object() || found == at->end()) {
      return nullptr;
    }
    at = &*found;
  }
  return at;
}

/// Returns the value in a form suitable for names.
std::string name_text(const Json& value) {
  if (value.is_string()) {
    return value.get<std::string>();
  }
  if (value.is_number()) {
    return number_text(value.get<double>());
  }
  if (value.is_null()) {
    return "default";
  }
  if (value.is_structured()) {
    std::string text;
    for (const Json& part : value) {
      text += (text.empty() ? "" : "x") + name_text(part);
    }
    return text;
  }
  return dump(value);
}

struct Naming {
  const std::string& pattern;
  const std::vector<Axis>& axes;
  const Json& values;  ///< the job's, by the keys of the axes
  const Json& job;

  /// Returns the value for a key in braces; null if there is no such member.
  const Json* value_of(const std::string& key) const {
    const Json* found = nullptr;
    for (const Axis& axis : axes) {
      if (axis.key == key) {
        return &values.at(axis.key);
      }
      if (axis.path.back() == key) {
        found = &values.at(axis.key);
      }
    }
    return found != nullptr ? found : member_at(job, split_path(key));
  }

  /// Returns an empty name and adds a fault if the pattern cannot be filled in.
  std::string name(std::size_t index, Faults& faults) const {
    std::string made;
    for (std::size_t i = 0; i < pattern.size(); ++i) {
      const std::size_t end = pattern[i] == '{' ? pattern.find('}', i) : std::string::npos;
      if (end == std::string::npos) {
        made += pattern[i];
        continue;
      }
      const std::string key = pattern.substr(i + 1, end - i - 1);
      const Json* value = value_of(key);
      if (key == "index") {
        made += std::to_string(index + 1);
      } else if (value != nullptr) {
        made += name_text(*value);
      } else {
        faults.add("/name", "{" + key + "} is not a member of the jobs");
        return {};
      }
      i = end;
    }
    return made;
  }
};

std::string usual_pattern(const std::vector<Axis>& axes) {
  std::string pattern;
  for (const Axis& axis : axes) {
    pattern += (pattern.empty() ? "{" : "-{") + axis.key + "}";
  }
  return pattern;
}

Parsed<BatchJob> make_job(const Body& body, const std::vector<Axis>& axes, std::size_t index) {
  const std::vector<std::size_t> choices = choices_of(axes, index);
  Json job = body.job_template;
  Json values = Json::object();
  BatchJob made;
  for (std::size_t i = 0; i < axes.size(); ++i) {
    const Json& value = axes[i].values[choices[i]];
    put(job, axes[i].path, value);
    values[axes[i].key] = value;
    made.origins.emplace_back(axes[i].pointer(), join_pointer(join_pointer("/matrix", axes[i].key),
                                                              std::to_string(choices[i])));
  }
  Faults faults;
  made.name = Naming{body.name, axes, values, job}.name(index, faults);
  if (!faults.empty()) {
    return faults.problem();
  }
  job["name"] = made.name;
  made.values = dump(values);
  auto parsed = parse_job(dump(job));
  if (!parsed) {
    return batch_problem(parsed.problem(), made);
  }
  if (parsed->spec.job_class != JobClass::kNormal) {
    faults.add("/template/class", "jobs of a batch must be of class normal");
    return faults.problem();
  }
  made.job = *std::move(parsed);
  return made;
}

bool is_at_or_in(std::string_view pointer, std::string_view place) {
  return pointer.substr(0, place.size()) == place &&
         (pointer.size() == place.size() || pointer[place.size()] == '/');
}

std::string origin_of(const std::string& pointer, const BatchJob& job) {
  if (pointer == "/name") {
    return pointer;
  }
  for (const auto& [place, origin] : job.origins) {
    if (is_at_or_in(pointer, place)) {
      return origin + pointer.substr(place.size());
    }
  }
  return "/template" + pointer;
}

}  // namespace

Problem batch_problem(Problem problem, const BatchJob& job) {
  for (FieldError& error : problem.errors) {
    error.pointer = origin_of(error.pointer, job);
  }
  return problem;
}

Parsed<BatchRequest> parse_batch(std::string_view text_of_body) {
  Parsed<Body> parsed = parse_body<Body>(batch_table(), text_of_body);
  if (!parsed) {
    return parsed.problem();
  }
  Body& body = *parsed;
  Faults faults;
  const std::vector<Axis> axes = axes_of(body.matrix);
  if (body.name.empty()) {
    body.name = usual_pattern(axes);
  }
  BatchRequest request{body.name, body.with_webhook.webhook, {}};
  std::size_t count = 1;
  for (const Axis& axis : axes) {
    count *= axis.values.size();
  }
  std::set<std::string> names;
  for (std::size_t i = 0; i < count; ++i) {
    auto job = make_job(body, axes, i);
    if (!job) {
      return job.problem();
    }
    if (!names.insert(job->name).second) {
      faults.add("/name",
                 "names two jobs " + shown(Json(job->name)) + "; {index} tells them apart");
      return faults.problem();
    }
    request.jobs.push_back(*std::move(job));
  }
  return request;
}

Json batch_request_schema() {
  return object_schema(batch_table(), Body{},
                       "A template and a matrix of values that define jobs.");
}

}  // namespace api

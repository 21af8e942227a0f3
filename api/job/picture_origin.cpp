#include "api/job/picture_origin.h"

#include <cmath>
#include <cstdlib>

#include <nlohmann/json.hpp>

#include "api/answers/job_view.h"
#include "api/json/errors.h"
#include "api/json/json.h"
#include "api/json/limits.h"

namespace api {
namespace {

const std::string* find(const std::map<std::string, std::string>& texts, const char* name) {
  const auto found = texts.find(name);
  return found == texts.end() ? nullptr : &found->second;
}

Problem refused(std::string detail) {
  return make_problem(core::ErrorCode::kInvalidArgument, std::move(detail));
}

}  // namespace

std::string picture_spec(const JobSpec& spec) {
  Json body = to_json(spec);
  body.erase("webhook");
  return dump(body);
}

Parsed<ParsedJob> parse_picture_origin(const std::map<std::string, std::string>& texts,
                                       std::string_view arithmetic) {
  const std::string* spec = find(texts, "tessera:spec");
  if (spec == nullptr) {
    return refused("the image does not contain its job: it has no text tessera:spec");
  }
  if (const std::string* samples = find(texts, "tessera:samples")) {
    return refused("the image was merged from samples that no single job can render: " + *samples);
  }
  auto parsed = parse_job(*spec);
  if (!parsed) {
    return parsed.problem();
  }
  JobSpec& job = parsed->spec;
  job.webhook.reset();
  job.retention_seconds.reset();
  job.job_class = JobClass::kNormal;
  job.preview_key.reset();
  if (find(texts, "tessera:film_digest") != nullptr) {
    const std::string* text = find(texts, "tessera:samples_per_pixel");
    const double samples = text == nullptr ? 0 : std::strtod(text->c_str(), nullptr);
    if (!(samples >= 0.5 && samples < static_cast<double>(limits::kSamplesPerPixel) + 0.5)) {
      return refused(
          "the image does not contain its number of samples: its text tessera:samples_per_pixel is "
          "not a count");
    }
    // The film follows from the number of samples, whichever rule ended the job.
    job.stop = core::StopRules{.samples_per_pixel = static_cast<int>(std::lround(samples)),
                               .confidence = job.stop.confidence};
    const std::string* reason = find(texts, "tessera:stop_reason");
    if (core::is_by_error(stop_reason_from_text(reason != nullptr ? *reason : "")
                              .value_or(core::StopReason::kNone)) ||
        find(texts, "tessera:samples_by_error") != nullptr) {
      parsed->samples_by_error = *job.stop.samples_per_pixel;
    }
  } else {
    parsed->warnings.emplace_back(
        "The image was saved before its job had ended; this is the complete job.");
  }
  const std::string* made_with = find(texts, "tessera:arithmetic");
  if (made_with != nullptr && !made_with->empty() && *made_with != arithmetic) {
    parsed->warnings.push_back("The image was made with " + *made_with + "; this server has " +
                               std::string(arithmetic) + ", and its bits may differ.");
  }
  return parsed;
}

}  // namespace api

// Light that was not found, in a job and in its stored row.
#include <array>
#include <cstdio>

#include <nlohmann/json.hpp>

#include "api/answers/job_view.h"
#include "api/answers/views.h"
#include "api/json/json.h"
#include "api/json/limits.h"
#include "api/json/values.h"

namespace api {

using core::LightNotFound;

const View<LightNotFound>& light_not_found_view() {
  static const View<LightNotFound> kView = {
      "LightNotFound",
      "How much light may be missing from the image, from particles that are counted beside it.",
      {{"at_most",
        shape::real("Light that neither the image nor the particles may have found, with the "
                    "confidence, over the image's mean luminance; 1 for a black image. Above 1 the "
                    "particles are too few for a view this small: nothing is known."),
        Member<&LightNotFound::at_most>::number},
       {"detected",
        shape::real("Light that the particles found and the image lacks, over the image's mean "
                    "luminance; 0: none."),
        Member<&LightNotFound::detected>::number},
       {"confidence", shape::real("Confidence level of `at_most`, and of all tiles together."),
        Member<&LightNotFound::confidence>::number},
       {"particles", shape::count("Number of particles."), Member<&LightNotFound::particles>::json},
       {"tiles", shape::count("Number of tiles that lack light."),
        [](const LightNotFound& l) -> Json { return l.tiles.size(); }},
       {"lacking", shape::list(shape::count(), "Those tiles, by number."),
        Member<&LightNotFound::tiles>::json},
       {"reason",
        shape::nullable(shape::text("A sentence: whose light is missing, and which integrator "
                                    "finds it; null: no tile lacks light.")),
        [](const LightNotFound& l) { return text_or_null(l.reason); }},
       {"integrators",
        shape::list(shape::text(), "The integrators in `reason`; empty: no tile lacks light."),
        Member<&LightNotFound::integrators>::json}}};
  return kView;
}

const ViewRow<JobView>& light_not_found_row() {
  static const ViewRow<JobView> kRow = {
      "light_not_found", shape::nullable(light_not_found_view().shape()), [](const JobView& j) {
        const auto& found = j.progress.light_not_found;
        return found ? light_not_found_view().print(*found) : Json(nullptr);
      }};
  return kRow;
}

std::string light_not_found_json(const std::optional<LightNotFound>& light) {
  return light ? dump(light_not_found_view().print(*light)) : std::string();
}

std::optional<LightNotFound> parse_light_not_found(std::string_view text) {
  const Parsed<Json> read = parse_json(text, limits::kBodyBytes);
  if (text.empty() || !read || !read->is_object()) {
    return std::nullopt;
  }
  LightNotFound light;
  light.at_most = read->value("at_most", 0.0);
  light.detected = read->value("detected", 0.0);
  light.confidence = read->value("confidence", light.confidence);
  light.particles = read->value("particles", 0U);
  light.tiles = read->value("lacking", std::vector<int>());
  light.integrators = read->value("integrators", std::vector<std::string>());
  const auto reason = read->find("reason");
  light.reason =
      reason != read->end() && reason->is_string() ? reason->get<std::string>() : std::string();
  return light;
}

std::string share_words(double share) {
  const double percent = 100 * share;
  constexpr double kLeast = 1e-4;  // below, %g has an exponent
  if (percent > 0 && percent < kLeast) {
    return "less than 0.0001%";
  }
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), percent >= 10 ? "%.0f%%" : "%.2g%%", percent);
  return text.data();
}

std::string light_words(const LightNotFound& light) {
  if (!light.reason.empty()) {
    return light.reason;
  }
  if (light.at_most >= 1) {
    return "How much light may be missing is not known: too few particles reach the image.";
  }
  return "Up to " + share_words(light.at_most) + " of the light may be missing.";
}

}  // namespace api

#include "server/scenes/scene_facts.h"

#include <algorithm>
#include <locale>
#include <sstream>

#include "api/job/job_checks.h"
#include "api/json/json.h"
#include "core/camera/camera_choice.h"
#include "core/integrators/rules.h"
#include "core/render/picture/view.h"
#include "server/http/text.h"

namespace server {
namespace {

/// Percent-escapes characters that separate words.
std::string word(std::string_view text) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string escaped;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte <= ' ' || c == '%' || byte == 0x7f) {
      escaped += '%';
      escaped += kDigits[byte >> 4U];
      escaped += kDigits[byte & 15U];
    } else {
      escaped += c;
    }
  }
  return escaped;
}

std::string unword(std::string_view text) {
  return percent_decode(text, PlusSign::kIsPlus).value_or(std::string(text));
}

std::string listed(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) {
    text += text.empty() ? "" : ", ";
    text += '"' + name + '"';
  }
  return text.empty() ? "none" : text;
}

/// Materials of such a file may differ at the job's time.
bool animates_materials(const core::SceneSummary& summary) {
  const auto& names = summary.extensions;
  return std::find(names.begin(), names.end(), "KHR_animation_pointer") != names.end();
}

void add_number(std::string& text, double number) { text += " " + api::number_text(number); }

std::string points_text(const std::vector<core::Vec3>& points) {
  std::string text;
  for (const core::Vec3& point : points) {
    for (const float side : {point.x, point.y, point.z}) {
      add_number(text, api::shortest_double(side));
    }
  }
  return text;
}

std::string place_text(const core::Place& place) {
  std::string text;
  for (const double side : {place.x, place.y, place.z}) {
    add_number(text, side);
  }
  return text;
}

/// Reads three numbers a point, of which `Point` is made, to the end or to text that is none.
template <typename Point, typename Number>
std::vector<Point> read_points(const std::string& text) {
  std::vector<Point> points;
  std::istringstream numbers(text);
  numbers.imbue(std::locale::classic());
  for (Number x, y, z; numbers >> x >> y >> z;) {
    points.push_back(Point{x, y, z});
  }
  return points;
}

}  // namespace

std::string encode_facts(const core::SceneSummary& summary, std::uint64_t load_bytes) {
  std::string text;
  for (const core::CameraDescription& camera : summary.cameras) {
    text += (camera.orthographic ? "orthographic " : "perspective ") + word(camera.name) + "\n";
  }
  for (const std::string& variant : summary.variants) {
    text += "variant " + word(variant) + "\n";
  }
  for (const std::string& group : summary.light_groups) {
    text += "light_group " + word(group) + "\n";
  }
  for (const core::PunctualLightDescription& light : summary.lights) {
    text += "light " + word(light.name) + "\n";
  }
  if (summary.has_emissive_strength) {
    text += "emissive_strength 1\n";
  }
  if (summary.has_environment) {
    text += "environment 1\n";
  }
  if (summary.has_scattering && !animates_materials(summary)) {
    text += "scattering 1\n";
  }
  if (summary.has_dispersion && !animates_materials(summary)) {
    text += "dispersion 1\n";
  }
  if (!summary.bounds.empty()) {
    text += "bounds" + points_text({summary.bounds.min, summary.bounds.max}) + "\n";
    text += "origin" + place_text(summary.origin) + "\n";
    text += "extremes" + points_text(summary.extremes) + "\n";
  }
  text += "triangles " + std::to_string(summary.triangles) + "\n";
  text += "bytes " + std::to_string(summary.bytes) + "\n";
  text += "load_bytes " + std::to_string(load_bytes) + "\n";
  return text;
}

std::uint64_t load_bytes_of(std::string_view facts) {
  constexpr std::string_view kName = "\nload_bytes ";
  const auto at = facts.find(kName);
  if (at == std::string_view::npos) {
    return 0;
  }
  const std::string_view value = facts.substr(at + kName.size());
  return parse_decimal(value.substr(0, value.find('\n'))).value_or(0);
}

bool lacks_extremes(const core::SceneSummary& facts) {
  return facts.extremes.empty() && !facts.bounds.empty();
}

core::SceneSummary decode_facts(std::string_view text) {
  core::SceneSummary summary;
  while (!text.empty()) {
    const auto end = text.find('\n');
    const std::string_view line = text.substr(0, end);
    text = end == std::string_view::npos ? std::string_view() : text.substr(end + 1);
    const auto space = line.find(' ');
    if (space == std::string_view::npos) {
      continue;
    }
    const std::string_view kind = line.substr(0, space);
    const std::string value = unword(line.substr(space + 1));
    if (kind == "orthographic" || kind == "perspective") {
      core::CameraDescription camera;
      camera.name = value;
      camera.orthographic = kind == "orthographic";
      summary.cameras.push_back(std::move(camera));
    } else if (kind == "variant") {
      summary.variants.push_back(value);
    } else if (kind == "light_group") {
      summary.light_groups.push_back(value);
    } else if (kind == "light") {
      core::PunctualLightDescription light;
      light.name = value;
      summary.lights.push_back(std::move(light));
    } else if (kind == "emissive_strength") {
      summary.has_emissive_strength = true;
    } else if (kind == "environment") {
      summary.has_environment = true;
    } else if (kind == "scattering") {
      summary.has_scattering = true;
    } else if (kind == "dispersion") {
      summary.has_dispersion = true;
    } else if (kind == "bounds") {
      for (const core::Vec3& point : read_points<core::Vec3, float>(value)) {
        summary.bounds.add(point);
      }
    } else if (kind == "extremes") {
      summary.extremes = read_points<core::Vec3, float>(value);
    } else if (kind == "origin") {
      for (const core::Place& place : read_points<core::Place, double>(value)) {
        summary.origin = place;
      }
    } else if (kind == "triangles") {
      summary.triangles = static_cast<std::size_t>(parse_decimal(value).value_or(0));
    } else if (kind == "bytes") {
      summary.bytes = static_cast<std::size_t>(parse_decimal(value).value_or(0));
    }
  }
  return summary;
}

std::vector<api::FieldError> stop_faults_against_scene(const core::StopRules& stop,
                                                       const core::SceneSummary& facts) {
  // The job's settings were checked without the scene.
  const core::SceneTraits traits = core::traits_of(facts);
  std::vector<api::FieldError> faults;
  for (core::BrokenRule& rule : core::broken_stop_rules(stop, core::RenderSettings(), &traits)) {
    faults.push_back({std::move(rule.pointer), std::move(rule.reason)});
  }
  return faults;
}

std::vector<api::FieldError> faults_against_scene(const api::JobSpec& spec,
                                                  const core::SceneSummary& facts) {
  api::Faults faults;
  const auto chosen = core::chosen_camera(spec.camera, facts.cameras);
  if (!chosen) {
    faults.add(chosen.error().where, chosen.error().message);
  } else if (!spec.camera.type) {
    const bool is_posed = spec.camera.is_placed() || spec.orbit;
    const core::CameraType type = core::camera_type(spec.camera, *chosen, is_posed);
    if (const core::Status fits = core::check_members(spec.camera, type); !fits) {
      faults.add(fits.error().where, fits.error().message);
    }
  }
  if (spec.variant && std::find(facts.variants.begin(), facts.variants.end(), *spec.variant) ==
                          facts.variants.end()) {
    faults.add("/variant", '"' + *spec.variant + "\" is not a variant of the scene; available: " +
                               listed(facts.variants));
  }
  core::SceneTraits traits = core::traits_of(facts);
  if (facts.light_groups.empty()) {
    traits.light_groups.reset();  // absent in facts stored by an older build
  }
  api::check_rules(spec, &traits, faults);
  for (const api::FieldError& fault : stop_faults_against_scene(spec.stop, facts)) {
    faults.add(fault.pointer, fault.detail);
  }
  return faults.empty() ? std::vector<api::FieldError>() : faults.problem().errors;
}

}  // namespace server

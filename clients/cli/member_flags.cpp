#include "clients/cli/member_flags.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <limits>
#include <system_error>
#include <tuple>
#include <utility>

#include "api/json/limits.h"
#include "clients/cli/command.h"
#include "clients/cli/job_json.h"

namespace cli {
namespace {

namespace limits = api::limits;
using Value = MemberFlag::Value;

constexpr MemberFlag share(const char* names, const char* pointer, const char* placeholder,
                           const char* text) {
  return {names,
          pointer,
          Value::kShare,
          placeholder,
          text,
          "",
          limits::kRelativeErrorMin,
          limits::kRelativeErrorMax};
}

constexpr std::array kStopFlags = {
    MemberFlag{"--samples,--spp", "/stop/samples_per_pixel", Value::kNumber, "N",
               "Stop after N samples per pixel", "256", 1, limits::kSamplesPerPixel},
    share("--relative-error", "/stop/relative_error", "E",
          "Stop when the relative error is at most E: 0.02, or 2%"),
    share("--denoised-error", "/stop/denoised_error", "E",
          "Stop when the relative error of the denoised image (mixed) is at most E"),
    share("--meter-error", "/stop/meter_error", "E",
          "Stop when the interval of every meter point is at most E of its reading wide"),
    share("--light-not-found", "/stop/light_not_found", "F",
          "Stop when at most this fraction of the light may be missing: 0.02, or 2%; error targets "
          "end the job only then"),
    MemberFlag{"--seconds", "/stop/seconds", Value::kNumber, "S",
               "Stop after S seconds of rendering", "", 0, limits::kStopSeconds, true},
    MemberFlag{"--cpu-seconds", "/stop/cpu_seconds", Value::kNumber, "S",
               "Stop after S CPU seconds of rendering, summed over all threads", "", 0,
               limits::kStopCpuSeconds, true},
};

constexpr std::array kViewFlags = {
    MemberFlag{"--fov", "/camera/vertical_fov_degrees", Value::kNumber, "D",
               "Vertical field of view, degrees", "", 0, 180, true},
    MemberFlag{"--aperture", "/camera/aperture_radius", Value::kNumber, "M",
               "Lens radius for depth of field, metres", "0", 0, limits::kMetres},
    MemberFlag{"--focus", "/camera/focus_distance", Value::kNumber, "M", "Focus distance, metres",
               "", 0, limits::kMetres, true},
    MemberFlag{"--shutter", "/shutter_seconds", Value::kNumber, "S",
               "Seconds that the shutter is open, which blurs animated motion", "0", 0,
               limits::kSceneSeconds},
    MemberFlag{"--variant", "/variant", Value::kText, "NAME",
               "Name of the scene's material variant"},
    MemberFlag{"--rotation", "/environment/rotation_degrees", Value::kNumber, "D",
               "Rotation of the environment, counter-clockwise seen from above, degrees", "0"},
    MemberFlag{"--intensity", "/environment/intensity", Value::kNumber, "I",
               "Multiplier of the environment's light", "1"},
    MemberFlag{"--transparent", "/environment/visible", Value::kFalse, "",
               "Transparent background: the environment (white without --environment) lights the "
               "scene but is not visible"},
    MemberFlag{"--opaque-glass", "/background/through_glass", Value::kFalse, "",
               "Glass before a transparent background shows the environment instead of letting "
               "what is behind the image through"},
    MemberFlag{"--preset", "/environment/preset", Value::kText, "NAME",
               "Procedural studio light: studio, tent, rim"},
    MemberFlag{"--ground", "/ground/type", Value::kText, "TYPE",
               "catcher (shows only shadows and reflections on a transparent background), sweep, "
               "none"},
    MemberFlag{"--ground-height", "/ground/height", Value::kNumber, "M",
               "Height (y) of the ground, metres", "the model's lowest point"},
    MemberFlag{"--ground-reflection", "/ground/reflection", Value::kNumber, "0..1",
               "Weight of a smooth coat on the ground: 0 is diffuse, 1 reflects the model", "0"},
    MemberFlag{"--shadow", "/ground/shadow/color", Value::kText, "TYPE",
               "Colour of the shadow on a catcher: neutral (none), physical"},
    MemberFlag{"--shadow-strength", "/ground/shadow/strength", Value::kNumber, "0..1",
               "Strength of that shadow", "1"},
    MemberFlag{"--shadow-softness", "/ground/shadow/softness", Value::kNumber, "0..1",
               "Sine of the angle by which lights are widened for that shadow", "0"},
};

constexpr std::array kMethodFlags = {
    MemberFlag{"--integrator", "/integrator/type", Value::kText, "T",
               "Algorithm that traces light paths", "path"},
    MemberFlag{"--caustics", "/integrator/caustics", Value::kText, "MODE",
               "Photons of caustics for path: off, on, auto", "off"},
    MemberFlag{"--sampler", "/sampler/type", Value::kText, "T", "Sequence of sample points",
               "sobol"},
    MemberFlag{"--light-sampler", "/light_sampler/type", Value::kText, "T", "Light selection",
               "measured"},
    MemberFlag{"--mis", "/estimator/mis/type", Value::kText, "T",
               "MIS weighting: balance, power, maximum, optimal"},
    MemberFlag{"--roulette", "/estimator/roulette/type", Value::kText, "T", "Russian roulette",
               "throughput"},
    MemberFlag{"--control-variate", "/estimator/control_variate/type", Value::kText, "T",
               "Control variate: none, analytic, regression"},
    MemberFlag{"--adaptive", "/adaptive/type", Value::kText, "T", "Adaptive sampling: pilot, none"},
    MemberFlag{"--spectral", "/spectral", Value::kTrue, "",
               "Paths carry wavelengths instead of colours"},
    MemberFlag{"--seed", "/seed", Value::kNumber, "N",
               "Random seed; a different seed gives different noise", "0", 0, limits::kSeed},
};

/// Pre: the text is a number. Whole ones stay whole.
Json number_of(std::string_view text) {
  text.remove_prefix(text.starts_with('+') ? 1 : 0);
  const char* end = text.data() + text.size();
  std::int64_t whole = 0;
  const auto [stop, code] = std::from_chars(text.data(), end, whole);
  if (code == std::errc() && stop == end) {
    return whole;
  }
  double value = 0;
  std::from_chars(text.data(), end, value);
  return value;
}

void add_check(CLI::Option& option, const MemberFlag& flag) {
  if (flag.value == Value::kShare) {
    option.transform(share_within(flag.min, flag.max));
  } else if (flag.value == Value::kNumber) {
    constexpr double kAny = std::numeric_limits<double>::max();
    option.check(flag.is_open          ? above_zero(flag.max)
                 : flag.max > flag.min ? within(flag.min, flag.max)
                                       : within(-kAny, kAny));
  }
}

}  // namespace

std::span<const MemberFlag> stop_flags() { return kStopFlags; }
std::span<const MemberFlag> view_flags() { return kViewFlags; }
std::span<const MemberFlag> method_flags() { return kMethodFlags; }

void add_member_flags(CLI::App& app, std::span<const MemberFlag> flags, MemberValues& values,
                      bool has_standards) {
  for (const MemberFlag& flag : flags) {
    const std::string standard = flag.standard;
    const std::string text =
        flag.text + (has_standards && !standard.empty() ? " (" + standard + ")" : "");
    if (flag.value == Value::kTrue || flag.value == Value::kFalse) {
      app.add_flag_callback(
          flag.names,
          [&values, &flag] {
            values.push_back({flag.pointer, flag.value == Value::kTrue});
          },
          text);
      continue;
    }
    const auto take = [&values, &flag](const std::string& given) {
      values.push_back({flag.pointer, flag.value == Value::kText ? Json(given) : number_of(given)});
    };
    CLI::Option* option = app.add_option_function<std::string>(flag.names, take, text);
    add_check(*option->type_name(flag.placeholder), flag);
  }
}

/// Returns where a value that begins as a JSON object or array is no JSON; empty: nowhere.
std::string fault_of_json(const std::string& value) {
  if (!value.starts_with('{') && !value.starts_with('[')) {
    return "";
  }
  try {
    std::ignore = Json::parse(value);
  } catch (const Json::parse_error& error) {
    const std::size_t at = std::min(error.byte > 0 ? error.byte - 1 : 0, value.size());
    return '"' + value + "\" is not JSON at byte " + std::to_string(error.byte) +
           (at < value.size() ? ": \"" + value.substr(at) + '"' : ", where it ends");
  }
  const std::string fault = nesting_fault(value);
  return fault.empty() ? "" : "a value of --set " + fault;
}

void add_set_option(CLI::App& app, MemberValues& values) {
  const auto fault = [](const std::string& text) {
    const std::size_t sign = text.find('=');
    return sign != std::string::npos && sign > 0
               ? fault_of_json(text.substr(sign + 1))
               : '"' + text + "\" is not MEMBER=VALUE, such as integrator.max_depth=4";
  };
  const auto take = [&values](const std::vector<std::string>& all) {
    for (const std::string& text : all) {
      const std::size_t sign = text.find('=');
      std::string pointer = "/" + text.substr(0, sign);
      std::replace(pointer.begin(), pointer.end(), '.', '/');
      Json value = Json::parse(text.substr(sign + 1), nullptr, false);
      values.push_back(
          {std::move(pointer), value.is_discarded() ? Json(text.substr(sign + 1)) : value});
    }
  };
  app.add_option_function<std::vector<std::string>>(
         "--set", take,
         "Any member of the job request, such as integrator.max_depth=4; the value is JSON, or a "
         "text; may be repeated")
      ->check(CLI::Validator(fault, ""))
      ->allow_extra_args(false)
      ->type_name("MEMBER=VALUE");
}

void put(Json& request, std::string_view pointer, Json value) {
  Json* at = &request;
  while (!pointer.empty()) {
    if (!at->is_object()) {
      *at = Json::object();
    }
    const std::size_t end = std::min(pointer.find('/', 1), pointer.size());
    at = &(*at)[std::string(pointer.substr(1, end - 1))];
    pointer.remove_prefix(end);
  }
  *at = std::move(value);
}

void put(Json& request, const MemberValues& values) {
  for (const MemberValue& member : values) {
    put(request, member.pointer, member.value);
  }
}

}  // namespace cli

// Readings of a job's meter.
#include "api/job_view.h"
#include "api/view_rows.h"
#include "api/views.h"

namespace api {
namespace {

Json triple_of(core::Vec3 v) { return {number_json(v.x), number_json(v.y), number_json(v.z)}; }
Json triple_of(core::Place v) { return {number_json(v.x), number_json(v.y), number_json(v.z)}; }

double watts(const core::MeterReading& reading) {
  return reading.illuminance / core::kLumensPerWatt;
}

}  // namespace

const View<core::MeterReading>& meter_reading_view() {
  using Reading = core::MeterReading;
  static const View<Reading> kView = {
      "MeterReading",
      "Light that arrives at one side of a point, in lux for all sources alike.",
      {{"position", shape::triple("World, metres."),
        [](const Reading& r) { return triple_of(r.at.position); }},
       {"normal", shape::triple("Unit normal."),
        [](const Reading& r) { return triple_of(r.at.normal); }},
       {"irradiance_w_m2", shape::real("Illuminance divided by 683 lm/W, for nominal white."),
        [](const Reading& r) { return number_json(watts(r)); }},
       {"illuminance_lux", shape::real("Luminance (Rec. 709) of irradiance_rgb."),
        [](const Reading& r) { return number_json(r.illuminance); }},
       {"low", shape::real("End of the 95% interval of illuminance_lux."),
        [](const Reading& r) { return number_json(r.low); }},
       {"high", shape::real("End of the 95% interval of illuminance_lux."),
        [](const Reading& r) { return number_json(r.high); }},
       {"unreliable",
        shape::flag("One of the 16 randomisations makes up most of the interval, or no path has "
                    "found light: the interval is only a guess."),
        [](const Reading& r) -> Json { return r.unreliable; }},
       {"irradiance_rgb", shape::triple("Lux per channel, linear."),
        [](const Reading& r) -> Json {
          return {number_json(r.irradiance[0]), number_json(r.irradiance[1]),
                  number_json(r.irradiance[2])};
        }},
       {"samples", shape::count("Paths, of 16 independent randomisations."),
        [](const Reading& r) -> Json { return r.samples; }}}};
  return kView;
}

const View<MeterView>& meter_view() {
  static const View<MeterView> kView = {
      "Meter",
      "Current readings of a job's meter.",
      {{"bias", shape::bias(), [](const MeterView&) -> Json { return "none"; }},
       {"confidence", shape::real("Confidence level of the intervals."),
        [](const MeterView&) { return number_json(core::kMeterConfidence); }},
       {"points",
        shape::list(meter_reading_view().shape(),
                    "The points, followed by the cells of the plane."),
        [](const MeterView& m) { return print_list(meter_reading_view(), m.readings); }}}};
  return kView;
}

std::string meter_json(std::span<const core::MeterReading> readings) {
  return dump(meter_view().print({readings}));
}

std::string meter_csv(std::span<const core::MeterReading> readings) {
  std::string text =
      "x,y,z,normal_x,normal_y,normal_z,irradiance_w_m2,illuminance_lux,low,high,samples,"
      "irradiance_r,irradiance_g,irradiance_b,unreliable\r\n";
  for (const core::MeterReading& r : readings) {
    for (const Json& value : {triple_of(r.at.position), triple_of(r.at.normal)}) {
      for (const Json& part : value) {
        text += part.dump() + ",";
      }
    }
    for (const double value : {watts(r), r.illuminance, r.low, r.high}) {
      text += number_text(value) + ",";
    }
    text += std::to_string(r.samples);
    for (const double value : r.irradiance) {
      text += "," + number_text(value);
    }
    text += r.unreliable ? ",true\r\n" : ",false\r\n";
  }
  return text;
}

}  // namespace api

// Readings of a job's meter.
#include "api/answers/job_view.h"
#include "api/answers/views.h"
#include "api/json/view_rows.h"

namespace api {
namespace {

/// A point of two meters.
struct MeterPairView {
  const core::MeterReading& a;
  const core::MeterReading& b;
};
struct MeterComparisonView {
  const MeterOfJob& a;
  const MeterOfJob& b;
};

Json triple_of(core::Vec3 v) { return {number_json(v.x), number_json(v.y), number_json(v.z)}; }
Json triple_of(core::Place v) { return {number_json(v.x), number_json(v.y), number_json(v.z)}; }

double watts(const core::MeterReading& reading) {
  return reading.illuminance / core::kLumensPerWatt;
}

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
        Member<&Reading::illuminance>::number},
       {"low", shape::real("End of the 95% interval of illuminance_lux."),
        Member<&Reading::low>::number},
       {"high", shape::real("End of the 95% interval of illuminance_lux."),
        Member<&Reading::high>::number},
       {"unreliable",
        shape::flag("One of the 16 randomisations makes up most of the interval, or no path has "
                    "found light: the interval is only a guess."),
        Member<&Reading::unreliable>::json},
       {"irradiance_rgb", shape::triple("Lux per channel, linear."),
        [](const Reading& r) -> Json {
          return {number_json(r.irradiance[0]), number_json(r.irradiance[1]),
                  number_json(r.irradiance[2])};
        }},
       {"samples", shape::count("Paths, of 16 independent randomisations."),
        Member<&Reading::samples>::json}}};
  return kView;
}

const View<MeterOfJob>& meter_view() {
  static const View<MeterOfJob> kView = {
      "Meter",
      "Current readings of a job's meter.",
      {{"bias", shape::bias(), [](const MeterOfJob&) -> Json { return "none"; }},
       {"confidence", shape::real("Confidence level of the intervals."),
        [](const MeterOfJob&) { return number_json(core::kMeterConfidence); }},
       {"mean_lux", shape::nullable(shape::real("Mean illuminance of the points.")),
        [](const MeterOfJob& m) { return number_json(core::mean_illuminance(m.readings)); }},
       {"uniformity",
        shape::nullable(shape::real("Least illuminance divided by the mean (U0 of EN 12464-1).")),
        [](const MeterOfJob& m) { return number_json(core::uniformity(m.readings)); }},
       {"outdoor_lux",
        shape::nullable(shape::real("Illuminance of an upward surface under the open sky of the "
                                    "job's environment, with its sun; null: it has none.")),
        Member<&MeterOfJob::outdoor_lux>::number},
       {"daylight_factor",
        shape::nullable(shape::real("mean_lux / outdoor_lux, a share: the CIE's daylight factor if "
                                    "the environment is an overcast sky and the only light.")),
        [](const MeterOfJob& m) {
          return number_json(core::mean_illuminance(m.readings) / m.outdoor_lux);
        }},
       {"points",
        shape::list(meter_reading_view().shape(),
                    "The points, followed by the cells of the plane."),
        [](const MeterOfJob& m) { return print_list(meter_reading_view(), m.readings); }}}};
  return kView;
}

const View<MeterPairView>& meter_pair_view() {
  using Pair = MeterPairView;
  static const View<Pair> kView = {
      "MeterPair",
      "A point of two meters.",
      {{"position", shape::triple("World, metres."),
        [](const Pair& p) { return triple_of(p.a.at.position); }},
       {"a_lux", shape::real(), [](const Pair& p) { return number_json(p.a.illuminance); }},
       {"b_lux", shape::real(), [](const Pair& p) { return number_json(p.b.illuminance); }},
       {"difference_lux", shape::real("a - b."),
        [](const Pair& p) { return number_json(core::difference_of(p.a, p.b).value); }},
       {"low", shape::real("End of the 95% interval of the difference."),
        [](const Pair& p) { return number_json(core::difference_of(p.a, p.b).low); }},
       {"high", shape::real("End of the 95% interval of the difference."),
        [](const Pair& p) { return number_json(core::difference_of(p.a, p.b).high); }}}};
  return kView;
}

const View<MeterOfJob>& meter_figures_view() {
  using Meter = MeterOfJob;
  static const View<Meter> kView = {
      "MeterFigures",
      "Figures of a job's meter; see Meter.",
      {{"job", shape::text("UUID."), Member<&Meter::job>::json},
       {"mean_lux", shape::real(),
        [](const Meter& m) { return number_json(core::mean_illuminance(m.readings)); }},
       {"uniformity", shape::nullable(shape::real()),
        [](const Meter& m) { return number_json(core::uniformity(m.readings)); }},
       {"daylight_factor", shape::nullable(shape::real()), [](const Meter& m) {
          return number_json(core::mean_illuminance(m.readings) / m.outdoor_lux);
        }}}};
  return kView;
}

const View<MeterComparisonView>& meter_comparison_view() {
  using Compared = MeterComparisonView;
  static const View<Compared> kView = {
      "MeterComparison",
      "The meters of two jobs compared point by point; b is the reference.",
      {{"a", meter_figures_view().shape(),
        [](const Compared& c) { return meter_figures_view().print(c.a); }},
       {"b", meter_figures_view().shape(),
        [](const Compared& c) { return meter_figures_view().print(c.b); }},
       {"difference_lux", shape::real("Mean of a - b."),
        [](const Compared& c) {
          return number_json(core::mean_illuminance(c.a.readings) -
                             core::mean_illuminance(c.b.readings));
        }},
       {"points", shape::list(meter_pair_view().shape(), "In the order of the meters."),
        [](const Compared& c) {
          Json points = Json::array();
          for (std::size_t i = 0; i < c.a.readings.size(); ++i) {
            points.push_back(meter_pair_view().print({c.a.readings[i], c.b.readings[i]}));
          }
          return points;
        }}}};
  return kView;
}

}  // namespace

std::string meter_json(const MeterOfJob& meter) { return dump(meter_view().print(meter)); }

std::string meter_comparison_json(const MeterOfJob& a, const MeterOfJob& b) {
  return dump(meter_comparison_view().print({a, b}));
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

void add_meter_schemas(Json& components) {
  meter_reading_view().add_to(components);
  meter_view().add_to(components);
  meter_figures_view().add_to(components);
  meter_pair_view().add_to(components);
  meter_comparison_view().add_to(components);
}

}  // namespace api

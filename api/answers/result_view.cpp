#include <array>
#include <cmath>
#include <limits>

#include <nlohmann/json.hpp>

#include "api/answers/job_view.h"
#include "api/answers/views.h"
#include "api/json/values.h"
#include "api/requests.h"

namespace api {
namespace {

struct ConvergenceView {
  std::span<const core::ConvergencePoint> points;
};

/// Returns the 0.975 quantile of Student's t. Table: NIST/SEMATECH e-Handbook 1.3.6.7.2; beyond it
/// the expansion in 1/df of Abramowitz and Stegun 26.7.5, whose error there is below 2e-4.
double student_t_975(std::size_t degrees) {
  constexpr std::array kTable = {12.7062, 4.3027, 3.1824, 2.7764, 2.5706,
                                 2.4469,  2.3646, 2.3060, 2.2622, 2.2281};
  if (degrees <= kTable.size()) {
    return kTable[degrees - 1];
  }
  constexpr double kZ = 1.959964;
  constexpr double kZ3 = kZ * kZ * kZ;
  constexpr double kZ5 = kZ3 * kZ * kZ;
  constexpr double kZ7 = kZ5 * kZ * kZ;
  const auto df = static_cast<double>(degrees);
  return kZ + (kZ3 + kZ) / (4 * df) + (5 * kZ5 + 16 * kZ3 + 3 * kZ) / (96 * df * df) +
         (3 * kZ7 + 19 * kZ5 + 17 * kZ3 - 15 * kZ) / (384 * df * df * df);
}

Json numbers_json(const std::vector<double>& values) {
  Json list = Json::array();
  for (const double value : values) {
    list.push_back(number_json(value));
  }
  return list;
}

std::string comparison_path(const ComparisonView& comparison) {
  return "/v1/comparisons/" + comparison.id;
}

std::string picture_path(const std::string& id) {
  return (is_uuid(id) ? "/v1/jobs/" : "/v1/assets/") + id;
}

const View<core::ConvergencePoint>& curve_point_view() {
  using Point = core::ConvergencePoint;
  static const View<Point> kView = {
      "ConvergencePoint",
      "The state of a job at one error check.",
      {{"samples_per_pixel", shape::count(), Member<&Point::samples_per_pixel>::json},
       {"elapsed_seconds", shape::real(), Member<&Point::elapsed_seconds>::number},
       {"cpu_seconds", shape::real(), Member<&Point::cpu_seconds>::number},
       {"rays", shape::count(), Member<&Point::rays>::json},
       {"relative", shape::nullable(shape::real()),
        [](const Point& p) { return number_json(p.error.relative); }},
       {"low", shape::nullable(shape::real()),
        [](const Point& p) { return number_json(p.error.low); }},
       {"high", shape::nullable(shape::real()),
        [](const Point& p) { return number_json(p.error.high); }},
       {"grain", shape::nullable(shape::real()),
        [](const Point& p) { return number_json(p.error.grain); }},
       {"doubt", shape::nullable(shape::real()),
        [](const Point& p) { return number_json(p.error.doubt); }},
       {"relative_rmse", shape::nullable(shape::real("Deprecated: the same as `relative`.")),
        [](const Point& p) { return number_json(p.error.relative); }}}};
  return kView;
}

/// A value with its 95% interval.
const View<Slope>& slope_view() {
  static const View<Slope> kView = {
      "",
      "Slope of log error against log samples, by least squares, with its 95% interval.",
      {{"value", shape::nullable(shape::real()), Member<&Slope::value>::number},
       {"low", shape::nullable(shape::real()), Member<&Slope::low>::number},
       {"high", shape::nullable(shape::real()), Member<&Slope::high>::number}}};
  return kView;
}

const View<PixelLayer>& pixel_layer_view() {
  static const View<PixelLayer> kView = {
      "PixelLayer",
      "One layer at one pixel, with one number per channel.",
      {{"mean", shape::reals(), [](const PixelLayer& l) { return numbers_json(l.mean); }},
       {"standard_error", shape::reals(),
        [](const PixelLayer& l) { return numbers_json(l.standard_error); }},
       {"low", shape::reals("Lower bounds of the 95% interval."),
        [](const PixelLayer& l) { return numbers_json(l.low); }},
       {"high", shape::reals("Upper bounds of the 95% interval."),
        [](const PixelLayer& l) { return numbers_json(l.high); }},
       {"halves",
        shape::nullable(shape::list(shape::reals(), "Halves A and B; null if the layer has none.")),
        [](const PixelLayer& l) {
          Json halves = Json::array();
          for (const auto& half : l.halves) {
            halves.push_back(numbers_json(half));
          }
          return l.halves.empty() ? Json(nullptr) : halves;
        }}}};
  return kView;
}

const View<ConvergenceView>& convergence_view() {
  static const View<ConvergenceView> kView = {
      "Convergence",
      "Get the error over samples and time.",
      {{"points", shape::list(curve_point_view().shape(), "One for each error check."),
        [](const ConvergenceView& c) { return print_list(curve_point_view(), c.points); }},
       {"slope", slope_view().shape(),
        [](const ConvergenceView& c) { return slope_view().print(fit_slope(c.points)); }}}};
  return kView;
}

const View<PixelView>& pixel_view() {
  static const View<PixelView> kView = {
      "Pixel",
      "One pixel.",
      {{"x", shape::count(), Member<&PixelView::x>::json},
       {"y", shape::count(), Member<&PixelView::y>::json},
       {"samples", shape::count(), Member<&PixelView::samples>::json},
       {"layers", shape::map(pixel_layer_view().shape(), "Layers by name."),
        [](const PixelView& p) {
          Json layers = Json::object();
          for (const PixelLayer& layer : p.layers) {
            layers[layer.name] = pixel_layer_view().print(layer);
          }
          return layers;
        }}}};
  return kView;
}

const View<ComparisonView>& bias_view() {
  using Compared = ComparisonView;
  static const View<Compared> kView = {
      "",
      "Mean of a - b; its interval is null if the error of a side is unknown.",
      {{"value", shape::nullable(shape::real()), Member<&Compared::bias>::number},
       {"low", shape::nullable(shape::real()), Member<&Compared::bias_low>::number},
       {"high", shape::nullable(shape::real()), Member<&Compared::bias_high>::number}}};
  return kView;
}

const View<ComparisonView>& z_view() {
  using Compared = ComparisonView;
  static const View<Compared> kView = {
      "",
      "Statistics of (a-b) / standard error.",
      {{"mean", shape::nullable(shape::real()), Member<&Compared::z_mean>::number},
       {"variance", shape::nullable(shape::real()), Member<&Compared::z_variance>::number},
       {"share_above_3", shape::nullable(shape::real()),
        Member<&Compared::z_share_above_3>::number}}};
  return kView;
}

const View<ComparisonView>& comparison_links_view() {
  using Compared = ComparisonView;
  static const View<Compared> kView = {
      "",
      "Paths.",
      {{"self", shape::text(), [](const Compared& c) -> Json { return comparison_path(c); }},
       {"difference", shape::text(),
        [](const Compared& c) -> Json { return comparison_path(c) + "/difference.png"; }},
       {"z", shape::text(),
        [](const Compared& c) -> Json { return comparison_path(c) + "/z.png"; }},
       {"flip", shape::text(),
        [](const Compared& c) -> Json { return comparison_path(c) + "/flip.png"; }},
       {"a", shape::text(), [](const Compared& c) -> Json { return picture_path(c.a); }},
       {"b", shape::text(), [](const Compared& c) -> Json { return picture_path(c.b); }}}};
  return kView;
}

const View<ComparisonView>& comparison_view() {
  using Compared = ComparisonView;
  static const View<Compared> kView = {
      "Comparison",
      "Two images compared; b is the reference.",
      {{"id", shape::text(), Member<&Compared::id>::json},
       {"mse", shape::nullable(shape::real()), Member<&Compared::mse>::number},
       {"relmse", shape::nullable(shape::real("Mean of (a-b)^2 / (b^2 + 0.01).")),
        Member<&Compared::relmse>::number},
       {"flip", shape::nullable(shape::real("LDR, 67 pixels per degree.")),
        Member<&Compared::flip>::number},
       {"bias", bias_view().shape(), [](const Compared& c) { return bias_view().print(c); }},
       {"z", z_view().shape(), [](const Compared& c) { return z_view().print(c); }},
       {"links", comparison_links_view().shape(),
        [](const Compared& c) { return comparison_links_view().print(c); }}}};
  return kView;
}

}  // namespace

Slope fit_slope(std::span<const core::ConvergencePoint> points) {
  const double unknown = std::numeric_limits<double>::quiet_NaN();
  std::vector<double> x;
  std::vector<double> y;
  for (const core::ConvergencePoint& point : points) {
    const double error = point.error.relative;
    if (point.samples_per_pixel > 0 && std::isfinite(error) && error > 0) {
      x.push_back(std::log(static_cast<double>(point.samples_per_pixel)));
      y.push_back(std::log(error));
    }
  }
  const auto n = static_cast<double>(x.size());
  double mean_x = 0;
  double mean_y = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    mean_x += x[i] / n;
    mean_y += y[i] / n;
  }
  double sxx = 0;
  double sxy = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    sxx += (x[i] - mean_x) * (x[i] - mean_x);
    sxy += (x[i] - mean_x) * (y[i] - mean_y);
  }
  if (!(sxx > 0)) {
    return {unknown, unknown, unknown};
  }
  const double slope = sxy / sxx;
  if (x.size() < 3) {
    return {slope, unknown, unknown};
  }
  double residual = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double r = y[i] - mean_y - slope * (x[i] - mean_x);
    residual += r * r;
  }
  const double half_width = student_t_975(x.size() - 2) * std::sqrt(residual / (n - 2) / sxx);
  return {slope, slope - half_width, slope + half_width};
}

std::string convergence_json(std::span<const core::ConvergencePoint> points) {
  return dump(convergence_view().print({points}));
}

std::string pixel_json(const PixelView& pixel) { return dump(pixel_view().print(pixel)); }

std::string comparison_json(const ComparisonView& comparison) {
  return dump(comparison_view().print(comparison));
}

void add_result_schemas(Json& components) {
  curve_point_view().add_to(components);
  convergence_view().add_to(components);
  pixel_layer_view().add_to(components);
  pixel_view().add_to(components);
}

void add_comparison_schemas(Json& components) { comparison_view().add_to(components); }

}  // namespace api

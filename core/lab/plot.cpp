#include "core/lab/plot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace core::lab {
namespace {

// Size of the drawing in pixels.
constexpr double kWidth = 640;
constexpr double kHeight = 440;
constexpr double kLeft = 76;
constexpr double kRight = 24;
constexpr double kTop = 64;
constexpr double kBottom = 56;
// Width of the point plots next to it: all pairs of axes, in two columns if there are several.
constexpr double kPatterns = 336;
constexpr double kGap = 16;

std::string number(double value, const char* format = "%.4g") {
  char buffer[48];
  std::snprintf(buffer, sizeof buffer, format, value);
  return buffer;
}

std::string pixel(double value) { return number(value, "%.1f"); }

std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    out += c == '&' ? "&amp;" : c == '<' ? "&lt;" : c == '>' ? "&gt;" : std::string(1, c);
  }
  return out;
}

/// Decades that contain all values; at least one.
struct Axis {
  double low = 0;  ///< log10
  double high = 1;

  void cover(double log_low, double log_high) {
    low = std::floor(log_low + 1e-9);
    high = std::max(std::ceil(log_high - 1e-9), low + 1);
  }
  double at(double log_value) const { return (log_value - low) / (high - low); }
};

class Plot {
 public:
  Plot(std::span<const Point> points, const Outcome& outcome) : outcome_(outcome) {
    for (const Point& p : points) {
      if (p.rmse > 0) {
        points_.push_back(p);
      }
    }
    if (points_.empty()) {
      return;
    }
    const auto [least, most] = std::minmax_element(points_.begin(), points_.end(),
                                                   [](auto& a, auto& b) { return a.n < b.n; });
    first_ = std::log10(static_cast<double>(least->n));
    last_ = std::log10(static_cast<double>(most->n));
    const auto [small, large] = std::minmax_element(
        points_.begin(), points_.end(), [](auto& a, auto& b) { return a.rmse < b.rmse; });
    x_.cover(first_, last_);
    y_.cover(std::log10(small->rmse), std::log10(large->rmse));
  }

  std::string body() const {
    if (points_.empty()) {
      return "<text x=\"" + pixel(kWidth / 2) + "\" y=\"" + pixel(kHeight / 2) +
             "\" text-anchor=\"middle\">No error at all: the estimate is exact.</text>\n";
    }
    std::string text = grid();
    if (outcome_.expected_slope) {
      // Through the centroid of the measured points.
      double x = 0;
      double y = 0;
      for (const Point& p : points_) {
        x += std::log10(static_cast<double>(p.n)) / static_cast<double>(points_.size());
        y += std::log10(p.rmse) / static_cast<double>(points_.size());
      }
      text += line("expected", y - *outcome_.expected_slope * x, *outcome_.expected_slope);
    }
    if (outcome_.slope) {
      text += line("fitted", *outcome_.intercept / std::log(10.0), *outcome_.slope);
    }
    for (const Point& p : points_) {
      text += "<circle cx=\"" + pixel(x(std::log10(static_cast<double>(p.n)))) + "\" cy=\"" +
              pixel(y(std::log10(p.rmse))) + "\" r=\"4\"><title>n " + std::to_string(p.n) +
              ", RMSE " + number(p.rmse) + "</title></circle>\n";
    }
    return text;
  }

 private:
  double x(double log_n) const { return kLeft + x_.at(log_n) * (kWidth - kLeft - kRight); }
  double y(double log_rmse) const {
    return kHeight - kBottom - y_.at(log_rmse) * (kHeight - kTop - kBottom);
  }

  static std::string decade(double exponent) {
    return "10<tspan dy=\"-5\" font-size=\"9\">" + number(exponent, "%.0f") + "</tspan>";
  }

  std::string grid() const {
    std::string text;
    for (double d = x_.low; d <= x_.high; ++d) {
      text += "<path class=\"grid\" d=\"M" + pixel(x(d)) + " " + pixel(kTop) + "V" +
              pixel(kHeight - kBottom) + "\"/><text x=\"" + pixel(x(d)) + "\" y=\"" +
              pixel(kHeight - kBottom + 18) + "\" text-anchor=\"middle\">" + decade(d) +
              "</text>\n";
    }
    // Labels every second or third decade if there are many.
    const double step = std::max(1.0, std::ceil((y_.high - y_.low) / 8));
    for (double d = y_.low; d <= y_.high; d += step) {
      text += "<path class=\"grid\" d=\"M" + pixel(kLeft) + " " + pixel(y(d)) + "H" +
              pixel(kWidth - kRight) + "\"/><text x=\"" + pixel(kLeft - 8) + "\" y=\"" +
              pixel(y(d) + 4) + "\" text-anchor=\"end\">" + decade(d) + "</text>\n";
    }
    return text;
  }

  std::string line(const char* kind, double intercept, double slope) const {
    return std::string("<path class=\"") + kind + "\" clip-path=\"url(#area)\" d=\"M" +
           pixel(x(first_)) + " " + pixel(y(intercept + slope * first_)) + "L" + pixel(x(last_)) +
           " " + pixel(y(intercept + slope * last_)) + "\"/>\n";
  }

  const Outcome& outcome_;
  std::vector<Point> points_;
  Axis x_;
  Axis y_;
  double first_ = 0;
  double last_ = 1;
};

/// Returns the points of the first replicate, one square per pair of axes.
std::string patterns(const Setup& setup, const Outcome& outcome) {
  constexpr std::string_view kAxes = "xyzw";
  const auto dimensions = static_cast<std::size_t>(setup.experiment->pattern_dimensions);
  const int columns = dimensions > 2 ? 2 : 1;
  const double step = dimensions > 2 ? (kHeight - kTop - kGap) / 3 : kPatterns - kGap;
  const double side = step - (dimensions > 2 ? kGap : 0);
  std::string text;
  int square = 0;
  for (std::size_t a = 0; a < dimensions; ++a) {
    for (std::size_t b = a + 1; b < dimensions; ++b, ++square) {
      const double left = kWidth + step * (square % columns);
      const double top = kTop + step * (square / columns);
      text += "<g transform=\"translate(" + pixel(left) + " " + pixel(top) + ")\"><title>" +
              std::string(1, kAxes[a]) + " and " + std::string(1, kAxes[b]) +
              "</title><path class=\"frame\" d=\"M0 0H" + pixel(side) + "V" + pixel(side) +
              "H0Z\"/><path class=\"points\" stroke-width=\"" + (dimensions > 2 ? "1.4" : "3") +
              "\" d=\"";
      // Draws a dot as a line of zero length with round caps.
      for (const Vec4& p : outcome.pattern) {
        const std::array<double, 4> at = {p.x, p.y, p.z, p.w};
        text += "M" + pixel(at[a] * side) + " " + pixel((1 - at[b]) * side) + "h0";
      }
      text += "\"/></g>\n";
    }
  }
  return text + "<text x=\"" + pixel(kWidth) + "\" y=\"" + pixel(kTop - 8) + "\">" +
         std::to_string(outcome.pattern.size()) + " points" +
         (dimensions > 2 ? ", each two of four axes" : "") + "</text>\n";
}

}  // namespace

std::string plot_svg(const Setup& setup, std::span<const Point> points, const Outcome& outcome) {
  const bool has_pattern = !outcome.pattern.empty();
  const std::string width = number(has_pattern ? kWidth + kPatterns : kWidth);
  const std::string height = number(kHeight);
  std::string text = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + width + "\" height=\"" +
                     height + "\" viewBox=\"0 0 " + width + " " + height +
                     "\" role=\"img\" font-family=\"system-ui, sans-serif\" font-size=\"12\">\n";
  const std::string title = std::string(setup.experiment->title) + ": " +
                            std::string(setup.estimator_name()) + ", " +
                            std::string(setup.sampler_name);
  text += "<title>" + escaped(title) + "</title>\n";
  text +=
      "<style>svg{background:#fff}text{fill:#333}.grid{stroke:#ddd}.fitted{stroke:#2563c9;stroke-"
      "width:2}"
      ".expected{stroke:#c2410c;stroke-width:2;stroke-dasharray:6 "
      "5}circle{fill:#2563c9}path{fill:none}"
      ".frame{stroke:#999}.points{stroke:#2563c9;stroke-linecap:round}"
      "@media(prefers-color-scheme:dark){svg{background:#16181d}text{fill:#ddd}.grid{stroke:#333}"
      ".fitted{stroke:#7aa7ff}.expected{stroke:#ff9a5c}circle{fill:#7aa7ff}.points{stroke:#7aa7ff}}"
      "</style>\n";
  text += "<clipPath id=\"area\"><rect x=\"" + pixel(kLeft) + "\" y=\"" + pixel(kTop) +
          "\" width=\"" + pixel(kWidth - kLeft - kRight) + "\" height=\"" +
          pixel(kHeight - kTop - kBottom) + "\"/></clipPath>\n";
  text += "<text x=\"" + pixel(kLeft) + "\" y=\"24\" font-size=\"15\" font-weight=\"600\">" +
          escaped(title) + "</text>\n<text x=\"" + pixel(kLeft) + "\" y=\"44\">";
  text += outcome.slope ? "fitted slope " + number(*outcome.slope, "%.3f") : "no slope";
  if (outcome.slope_interval) {
    text += " [" + number(outcome.slope_interval->low, "%.3f") + ", " +
            number(outcome.slope_interval->high, "%.3f") + "]";
  }
  if (outcome.expected_slope) {
    text += ", expected " + number(*outcome.expected_slope, "%.3f") + " (dashed)";
  }
  text += "; " + std::string(to_text(outcome.verdict)) + "</text>\n";
  text += Plot(points, outcome).body();
  if (has_pattern) {
    text += patterns(setup, outcome);
  }
  text += "<text x=\"" + pixel((kLeft + kWidth - kRight) / 2) + "\" y=\"" + pixel(kHeight - 12) +
          "\" text-anchor=\"middle\">n, " + escaped(setup.experiment->unit) + "</text>\n";
  text += "<text transform=\"translate(18 " + pixel((kTop + kHeight - kBottom) / 2) +
          ") rotate(-90)\" text-anchor=\"middle\">RMSE</text>\n</svg>\n";
  return text;
}

std::string points_csv(std::span<const Point> points) {
  std::string text = "n,mean,rmse,standard_error,cost,seconds\n";
  for (const Point& p : points) {
    text += std::to_string(p.n);
    for (const double value : {p.mean, p.rmse, p.standard_error, p.cost, p.seconds}) {
      text += "," + number(value, "%.17g");
    }
    text += "\n";
  }
  return text;
}

}  // namespace core::lab

#include "core/scene_io/ies.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "core/base/invalid.h"
#include "core/base/text.h"

namespace core {
namespace {

/// Limit of values and of their factor; floats can hold sums of the product.
constexpr double kCandelaMax = 1e9;
constexpr std::string_view kBlanks = " \t\r";

/// Returns what stands after the `=` of a TILT line; empty for other lines.
std::optional<std::string_view> tilt_of(std::string_view line) {
  const std::size_t equals = line.find('=');
  if (equals == std::string_view::npos ||
      !equal_ignoring_case(trimmed(line.substr(0, equals), kBlanks), "TILT")) {
    return std::nullopt;
  }
  return trimmed(line.substr(equals + 1), kBlanks);
}

class Reader {
 public:
  explicit Reader(std::string_view text) : text_(text) {}

  bool at_end() const { return at_ >= text_.size(); }

  std::string_view line() {
    const std::size_t end = std::min(text_.find('\n', at_), text_.size());
    const std::string_view line = text_.substr(at_, end - at_);
    at_ = std::min(end + 1, text_.size());
    return trimmed(line, kBlanks);
  }

  /// Reads a number; numbers are separated by blanks, line ends or commas. `to` is unchanged on
  /// failure.
  Status number(std::string_view what, double& to) {
    at_ = std::min(text_.find_first_not_of(kSeparators, at_), text_.size());
    if (at_end()) {
      return invalid(std::string("the file ends before ").append(what));
    }
    const std::size_t end = std::min(text_.find_first_of(kSeparators, at_), text_.size());
    std::string_view word = text_.substr(at_, end - at_);
    word.remove_prefix(word.starts_with('+') ? 1 : 0);
    double value = 0;
    const auto read = std::from_chars(word.data(), word.data() + word.size(), value);
    if (read.ec != std::errc() || read.ptr != word.data() + word.size() || !std::isfinite(value)) {
      return invalid("line " + std::to_string(line_number()) + ": " + std::string(what) +
                     " is not a number");
    }
    at_ = end;
    to = value;
    return ok_status();
  }

  Status number_in(std::string_view what, double min, double max, double& to) {
    if (auto status = number(what, to); !status) {
      return status;
    }
    if (to < min || to > max) {
      return invalid("line " + std::to_string(line_number()) + ": " + std::string(what) + " is " +
                     shortest_text(to) + ", outside of [" + shortest_text(min) + ", " +
                     shortest_text(max) + "]");
    }
    return ok_status();
  }

  Status count(std::string_view what, double min, std::size_t& to) {
    double value = 0;
    // There cannot be more numbers than characters.
    if (auto status = number_in(what, min, static_cast<double>(text_.size()), value); !status) {
      return status;
    }
    if (value != std::floor(value)) {
      return invalid(std::string(what) + " is " + shortest_text(value) + ", not a whole number");
    }
    to = static_cast<std::size_t>(value);
    return ok_status();
  }

  Status numbers(std::string_view what, std::size_t count, double min, double max,
                 std::vector<double>& to) {
    to.assign(count, 0);
    for (double& value : to) {
      if (auto status = number_in(what, min, max, value); !status) {
        return status;
      }
    }
    return ok_status();
  }

 private:
  static constexpr std::string_view kSeparators = " \t\r\n,";
  std::ptrdiff_t line_number() const {
    return 1 + std::count(text_.begin(), text_.begin() + static_cast<std::ptrdiff_t>(at_), '\n');
  }

  std::string_view text_;
  std::size_t at_ = 0;
};

/// A plane of the full profile, and the plane of the file that it repeats.
struct Plane {
  double degrees = 0;
  std::size_t source = 0;
};

/// Adds the mirror images of the planes beyond the last one.
void mirror_at_end(std::vector<Plane>& planes) {
  const double middle = planes.back().degrees;
  for (std::size_t i = planes.size() - 1; i-- > 0;) {
    planes.push_back({2 * middle - planes[i].degrees, planes[i].source});
  }
}

/// Completes the horizontal angles that the file omits by symmetry. Source: LM-63-02, 3.18, and,
/// for 90 to 270 degrees, LM-63-95.
Result<std::vector<Plane>> whole_planes(Photometry photometry, const std::vector<double>& degrees) {
  std::vector<Plane> planes;
  for (std::size_t i = 0; i < degrees.size(); ++i) {
    planes.push_back({degrees[i], i});
  }
  const double first = degrees.front();
  const double last = degrees.back();
  if (photometry != Photometry::kC) {
    if (first == 0 && last == 90) {
      std::vector<Plane> left;
      for (std::size_t i = planes.size(); i-- > 1;) {
        left.push_back({-planes[i].degrees, i});
      }
      planes.insert(planes.begin(), left.begin(), left.end());
      return planes;
    }
    if (first == -90 && last == 90) {
      return planes;
    }
    return invalid("horizontal angles from " + shortest_text(first) + " to " + shortest_text(last) +
                   " degrees; those of types A and B go from -90 or 0 to 90");
  }
  if (planes.size() == 1) {
    planes.push_back({planes[0].degrees + 360, 0});
  } else if (first == 90 && last == 270) {
    mirror_at_end(planes);
  } else if (first == 0 && (last == 90 || last == 180)) {
    for (; planes.back().degrees < 360;) {
      mirror_at_end(planes);
    }
  } else if (first == 0 && last > 180 && last < 360) {
    planes.push_back({360, 0});  // omitted by many files
  } else if (first != 0 || last != 360) {
    return invalid("horizontal angles from " + shortest_text(first) + " to " + shortest_text(last) +
                   " degrees; those of type C go from 0 to 0, 90, 180 or 360, or from 90 to 270");
  }
  return planes;
}

Status check_increasing(std::string_view what, const std::vector<double>& degrees) {
  for (std::size_t i = 1; i < degrees.size(); ++i) {
    if (!(degrees[i] > degrees[i - 1])) {
      return invalid(std::string(what) + " do not increase: " + shortest_text(degrees[i]) +
                     " follows " + shortest_text(degrees[i - 1]));
    }
  }
  return ok_status();
}

float radians(double degrees) { return static_cast<float>(degrees * std::numbers::pi / 180); }

/// The content of the file before its angles.
struct Head {
  Photometry photometry = Photometry::kC;
  std::size_t vertical = 0;
  std::size_t horizontal = 0;
  double factor = 1;
};

/// Reads up to the TILT line. From 1991 on the first line names the standard.
Status read_labels(Reader& in, bool& has_lamp_factor, std::vector<std::string>& warnings) {
  const std::string_view line = without_byte_order_mark(in.line());
  const std::string standard = in_lower_case(line);
  has_lamp_factor = !standard.starts_with("iesna:lm-63-1995") &&
                    !standard.starts_with("iesna:lm-63-2002") &&
                    !standard.starts_with("ies:lm-63-2019");
  auto tilt = tilt_of(line);
  while (!tilt) {
    if (in.at_end()) {
      return invalid("no line starts with TILT: not an IES LM-63 file");
    }
    tilt = tilt_of(in.line());
  }
  if (equal_ignoring_case(*tilt, "NONE")) {
    return ok_status();
  }
  warnings.emplace_back("a light profile has factors for tilted lamps (TILT), which were ignored");
  if (!equal_ignoring_case(*tilt, "INCLUDE")) {
    return ok_status();  // they are in another file
  }
  double geometry = 0;
  std::size_t count = 0;
  std::vector<double> values;
  if (auto status = in.number_in("the lamp's geometry", 1, 3, geometry); !status) {
    return status;
  }
  if (auto status = in.count("the number of tilt angles", 1, count); !status) {
    return status;
  }
  return in.numbers("a tilt angle or factor", 2 * count, -1e9, 1e9, values);
}

Status read_head(Reader& in, bool has_lamp_factor, Head& head) {
  constexpr double kAny = 1e9;
  double ignored = 0;
  double multiplier = 0;
  double type = 0;
  double ballast = 0;
  double lamp = 0;
  Status status = in.number_in("the number of lamps", 0, kAny, ignored);
  const auto next = [&](std::string_view what, double min, double& to) {
    status = status ? in.number_in(what, min, kAny, to) : status;
  };
  next("the lumens per lamp", -1, ignored);
  next("the candela multiplier", 0, multiplier);
  status = status ? in.count("the number of vertical angles", 2, head.vertical) : status;
  status = status ? in.count("the number of horizontal angles", 1, head.horizontal) : status;
  status = status ? in.number_in("the photometric type", 1, 3, type) : status;
  for (const std::string_view what :
       {"the type of units", "the width", "the length", "the height"}) {
    next(what, -kAny, ignored);  // negative sizes denote round luminaires
  }
  next("the ballast factor", 0, ballast);
  next("the ballast-lamp photometric factor", 0, lamp);
  next("the input watts", -kAny, ignored);
  if (!status) {
    return status;
  }
  if (type != std::floor(type)) {
    return invalid("the photometric type is " + shortest_text(type) +
                   "; 1, 2 and 3 are C, B and A");
  }
  head.photometry = static_cast<Photometry>(type);
  head.factor = multiplier * ballast * (has_lamp_factor ? lamp : 1);
  return ok_status();
}

/// Converts the planes of the file to IesProfile's grid.
IesProfile::Grid make_grid(const Head& head, const std::vector<double>& vertical,
                           const std::vector<Plane>& planes, const std::vector<double>& candela) {
  IesProfile::Grid grid;
  grid.photometry = head.photometry;
  const auto at = [&](std::size_t plane, std::size_t v) {
    return static_cast<float>(candela[planes[plane].source * vertical.size() + v] * head.factor);
  };
  const std::size_t last = vertical.size() - 1;
  switch (head.photometry) {
    case Photometry::kC:
    case Photometry::kA:
      for (std::size_t i = 0; i <= last; ++i) {
        grid.theta_rad.push_back(
            radians(head.photometry == Photometry::kC ? vertical[i] : 90 - vertical[last - i]));
      }
      for (std::size_t p = 0; p < planes.size(); ++p) {
        grid.phi_rad.push_back(radians(planes[p].degrees));
        for (std::size_t i = 0; i <= last; ++i) {
          grid.candela.push_back(at(p, head.photometry == Photometry::kC ? i : last - i));
        }
      }
      break;
    case Photometry::kB:
      for (std::size_t p = planes.size(); p-- > 0;) {
        grid.theta_rad.push_back(radians(90 - planes[p].degrees));
      }
      for (std::size_t i = 0; i <= last; ++i) {
        grid.phi_rad.push_back(radians(vertical[i]));
        for (std::size_t p = planes.size(); p-- > 0;) {
          grid.candela.push_back(at(p, i));
        }
      }
      break;
  }
  return grid;
}

}  // namespace

Result<IesProfile> read_ies(std::string_view text, std::vector<std::string>& warnings) {
  Reader in(text);
  bool has_lamp_factor = false;
  Head head;
  if (auto status = read_labels(in, has_lamp_factor, warnings); !status) {
    return status.error();
  }
  if (auto status = read_head(in, has_lamp_factor, head); !status) {
    return status.error();
  }
  if (head.vertical > text.size() / head.horizontal) {
    return invalid(std::to_string(head.horizontal) + " by " + std::to_string(head.vertical) +
                   " candela values do not fit in a file of " + std::to_string(text.size()) +
                   " bytes");
  }
  const bool is_c = head.photometry == Photometry::kC;
  std::vector<double> vertical;
  std::vector<double> horizontal;
  std::vector<double> candela;
  if (auto status =
          in.numbers("a vertical angle", head.vertical, is_c ? 0 : -90, is_c ? 180 : 90, vertical);
      !status) {
    return status.error();
  }
  if (auto status = in.numbers("a horizontal angle", head.horizontal, is_c ? 0 : -90,
                               is_c ? 360 : 90, horizontal);
      !status) {
    return status.error();
  }
  if (auto status =
          in.numbers("a candela value", head.vertical * head.horizontal, 0, kCandelaMax, candela);
      !status) {
    return status.error();
  }
  if (head.factor > kCandelaMax) {
    return invalid("the product of the candela multiplier and the ballast's factors is " +
                   shortest_text(head.factor));
  }
  for (const auto& [what, degrees] :
       {std::pair{"vertical angles", &vertical}, std::pair{"horizontal angles", &horizontal}}) {
    if (auto status = check_increasing(what, *degrees); !status) {
      return status.error();
    }
  }
  const auto planes = whole_planes(head.photometry, horizontal);
  if (!planes) {
    return planes.error();
  }
  return IesProfile(make_grid(head, vertical, *planes, candela));
}

}  // namespace core

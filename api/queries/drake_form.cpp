#include "api/queries/drake_form.h"

#include <tuple>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "api/json/limits.h"
#include "api/json/query_rows.h"

namespace api {
namespace {

constexpr double kMost = 1e9;  ///< as for members of a camera

const auto& table() {
  static constexpr auto kTable = std::tuple{
      required_text("scene_sha256", &DrakeForm::scene_sha256, {64, 64}, ""),
      required_text("image_type", &DrakeForm::image_type, {1, 16}, ""),
      number("width", &DrakeForm::width, {1, limits::kFilmSide}, ""),
      number("height", &DrakeForm::height, {1, limits::kFilmSide}, ""),
      number("focal_x", &DrakeForm::focal_x, {0, kMost, true}, ""),
      number("focal_y", &DrakeForm::focal_y, {0, kMost, true}, ""),
      number("center_x", &DrakeForm::center_x, {-kMost, kMost}, ""),
      number("center_y", &DrakeForm::center_y, {-kMost, kMost}, ""),
      number("min_depth", &DrakeForm::min_depth, {0, kMost}, ""),
      number("max_depth", &DrakeForm::max_depth, {0, kMost}, ""),
  };
  return kTable;
}

}  // namespace

Parsed<DrakeForm> parse_drake_form(QueryParams fields) {
  std::vector<std::pair<std::string, std::string>> known;
  for (const auto& field : fields) {
    const auto is_field = [&field](const auto&... row) {
      return ((row.name() == field.first) || ...);
    };
    if (std::apply(is_field, table())) {
      known.push_back(field);
    }
  }
  DrakeForm form;
  Faults faults;
  read_query(table(), known, form, faults);
  const auto require = [&](bool is_there, const std::string& name) {
    if (!is_there) {
      faults.add("/" + name, "is required");
    }
  };
  require(form.width > 0, "width");
  require(form.height > 0, "height");
  require(form.focal_x.has_value(), "focal_x");
  require(form.focal_y.has_value(), "focal_y");
  require(form.center_x.has_value(), "center_x");
  require(form.center_y.has_value(), "center_y");
  if (form.image_type == "depth") {
    require(form.min_depth.has_value(), "min_depth");
    require(form.max_depth.has_value(), "max_depth");
  } else if (form.image_type != "color" && form.image_type != "label" && !form.image_type.empty()) {
    faults.add("/image_type",
               shown(Json(form.image_type)) + " is not one of color, depth and label");
  }
  if (std::int64_t{form.width} * form.height > limits::kFilmPixels) {
    faults.add("/width", std::to_string(form.width) + " x " + std::to_string(form.height) +
                             " pixels; at most " + std::to_string(limits::kFilmPixels) +
                             " are allowed");
  }
  if (!faults.empty()) {
    return faults.problem();
  }
  return form;
}

std::string drake_job(const DrakeForm& form) {
  return dump({{"film", {{"width", form.width}, {"height", form.height}}},
               {"camera",
                {{"type", "pinhole"},
                 {"index", 0},
                 {"fx", *form.focal_x},
                 {"fy", *form.focal_y},
                 {"cx", *form.center_x},
                 {"cy", *form.center_y}}}});
}

}  // namespace api

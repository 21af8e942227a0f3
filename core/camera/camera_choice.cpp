#include "core/camera/camera_choice.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/camera/distortion.h"
#include "core/math/numbers.h"

namespace core {
namespace {

Error refused(std::string message, std::string pointer) {
  return {ErrorCode::kInvalidArgument, std::move(message), std::move(pointer)};
}

double norm(Place v) { return std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z); }

Status check_coefficients(const DistortionSettings& distortion) {
  const std::size_t count = distortion.k.size();
  const auto is_one_of = [count](std::vector<std::size_t> counts) {
    return std::find(counts.begin(), counts.end(), count) != counts.end();
  };
  const auto error = [count](const char* needed) {
    return refused("has " + std::to_string(count) + " coefficients; " + needed,
                   "/camera/distortion/k");
  };
  switch (distortion.model) {
    case DistortionModel::kNone:
      return count == 0 ? ok_status() : error("model 'none' has none");
    case DistortionModel::kOpencv:
      return is_one_of({4, 5, 8, 12}) ? ok_status() : error("model 'opencv' takes 4, 5, 8 or 12");
    case DistortionModel::kFisheye:
      return is_one_of({4}) ? ok_status() : error("model 'fisheye' takes 4");
  }
  return ok_status();
}

/// A lens is asked in a grid over the film, with its border.
Status check_lens(const CameraSettings& settings, int width, int height) {
  if (const Status counts = check_coefficients(settings.distortion); !counts) {
    return counts;
  }
  if (settings.distortion.model == DistortionModel::kNone) {
    return ok_status();
  }
  const Intrinsics film = intrinsics_of(settings, width, height);
  const Distortion lens(settings.distortion);
  constexpr int kCells = 64;
  for (int i = 0; i <= kCells; ++i) {
    for (int j = 0; j <= kCells; ++j) {
      const double x = static_cast<double>(j) * width / kCells;
      const double y = static_cast<double>(i) * height / kCells;
      if (!lens.unproject({(x - film.cx) / film.fx, (y - film.cy) / film.fy}).is_shown) {
        return refused("with these coefficients the image folds before pixel (" +
                           std::to_string(std::lround(x)) + ", " + std::to_string(std::lround(y)) +
                           "), where no direction is shown",
                       "/camera/distortion/k");
      }
    }
  }
  return ok_status();
}

Status check_pose(const CameraPose& pose) {
  const auto& m = pose.matrix;
  const std::string pointer = "/camera/pose/matrix";
  if (m[12] != 0 || m[13] != 0 || m[14] != 0 || m[15] != 1) {
    return refused("the last row is not 0 0 0 1; numbers go row by row", pointer);
  }
  constexpr double kTolerance = 1e-3;  // of matrices printed with four digits
  const auto column = [&m](std::size_t i) { return Place{m[i], m[4 + i], m[8 + i]}; };
  const std::array<Place, 3> axes = {column(0), column(1), column(2)};
  const auto product = [](Place a, Place b) { return a.x * b.x + a.y * b.y + a.z * b.z; };
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = i; j < 3; ++j) {
      if (!(std::fabs(product(axes[i], axes[j]) - (i == j ? 1 : 0)) <= kTolerance)) {
        return refused("its axes are not unit vectors at right angles", pointer);
      }
    }
  }
  const auto& [x, y, z] = axes;
  const Place normal = {x.y * y.z - x.z * y.y, x.z * y.x - x.x * y.z, x.x * y.y - x.y * y.x};
  return product(normal, z) > 0 ? ok_status() : refused("it is a reflection", pointer);
}

}  // namespace

bool span_view(Place forward, Place up) noexcept {
  // Sine of the angle below which two directions count as equal: float coordinates of a few metres
  // cannot distinguish them.
  constexpr double kParallelSine = 1e-6;
  constexpr double kShortest = 1e-16;  // its square is a float with all its digits
  const Place side = {forward.y * up.z - forward.z * up.y, forward.z * up.x - forward.x * up.z,
                      forward.x * up.y - forward.y * up.x};
  return length_squared(forward.rounded()) > 0 &&
         norm(side) > norm(forward) * std::max(kParallelSine * norm(up), kShortest);
}

std::vector<Error> view_faults(const CameraSettings& settings) {
  std::vector<Error> faults;
  if (settings.name && settings.index) {
    faults.push_back(
        refused("name and index both select a camera of the file; give only one", "/camera/index"));
  }
  const Place up = settings.up.value_or(Vec3{0, 1, 0});
  const bool has_up = norm(up) > 0;
  if (!has_up) {
    faults.push_back(refused("is the zero vector", "/camera/up"));
  }
  if (settings.position.has_value() != settings.target.has_value()) {
    faults.push_back(settings.position ? refused("is required with position", "/camera/target")
                                       : refused("is required with target", "/camera/position"));
  } else if (settings.position) {
    const Place forward = *settings.target - *settings.position;
    if (!(length_squared(forward.rounded()) > 0)) {
      faults.push_back(refused("equals position", "/camera/target"));
    } else if (has_up && !span_view(forward, up)) {
      faults.push_back(refused(settings.up ? "is parallel to the direction from position to target"
                                           : "is [0, 1, 0], which is parallel to the direction "
                                             "from position to target; give another",
                               "/camera/up"));
    }
  }
  return faults;
}

Result<const CameraDescription*> chosen_camera(const CameraSettings& settings,
                                               const std::vector<CameraDescription>& cameras) {
  if (settings.name) {
    for (const CameraDescription& camera : cameras) {
      if (camera.name == *settings.name) {
        return &camera;
      }
    }
    std::string names;
    int nameless = 0;
    for (const CameraDescription& camera : cameras) {
      nameless += camera.name.empty() ? 1 : 0;
      names += camera.name.empty() ? "" : (names.empty() ? "'" : ", '") + camera.name + "'";
    }
    if (nameless > 0) {
      names += (names.empty() ? "" : " and ") + std::to_string(nameless) +
               " without a name, which have an index from 0 to " +
               std::to_string(cameras.size() - 1);
    }
    return Error{ErrorCode::kInvalidArgument,
                 "the scene has no camera '" + *settings.name + "'; it has " +
                     (names.empty() ? std::string("none") : names),
                 "/camera/name"};
  }
  if (settings.index) {
    if (*settings.index < 0 || *settings.index >= static_cast<int>(cameras.size())) {
      return Error{ErrorCode::kInvalidArgument,
                   std::to_string(*settings.index) + " is not one of the scene's " +
                       std::to_string(cameras.size()) + " cameras",
                   "/camera/index"};
    }
    return &cameras[static_cast<std::size_t>(*settings.index)];
  }
  return cameras.empty() ? nullptr : &cameras.front();
}

CameraType camera_type(const CameraSettings& settings, const CameraDescription* file,
                       bool is_posed) noexcept {
  const bool is_orthographic = !is_posed && file != nullptr && file->orthographic;
  return settings.type.value_or(is_orthographic ? CameraType::kOrthographic
                                                : CameraType::kPerspective);
}

Status check_members(const CameraSettings& settings, CameraType type) {
  struct Member {
    bool is_given;
    CameraType type;  // to which alone it applies
    std::string_view cameras;
    std::string_view name;
  };
  constexpr std::string_view kPinholes = "pinhole";
  const std::array members = {
      Member{settings.vertical_fov_degrees.has_value(), CameraType::kPerspective, "perspective",
             "vertical_fov_degrees"},
      Member{settings.shift.has_value(), CameraType::kPerspective, "perspective", "shift"},
      Member{settings.orthographic_height_m.has_value(), CameraType::kOrthographic, "orthographic",
             "orthographic_height"},
      Member{settings.fx_px.has_value(), CameraType::kPinhole, kPinholes, "fx"},
      Member{settings.fy_px.has_value(), CameraType::kPinhole, kPinholes, "fy"},
      Member{settings.cx_px.has_value(), CameraType::kPinhole, kPinholes, "cx"},
      Member{settings.cy_px.has_value(), CameraType::kPinhole, kPinholes, "cy"},
      Member{settings.distortion != DistortionSettings{}, CameraType::kPinhole, kPinholes,
             "distortion"}};
  for (const Member& member : members) {
    if (member.is_given && member.type != type) {
      return refused("applies only to " + std::string(member.cameras) + " cameras",
                     "/camera/" + std::string(member.name));
    }
  }
  if (type == CameraType::kPinhole && !settings.fx_px) {
    return refused("is required for pinhole cameras", "/camera/fx");
  }
  if (settings.aperture_radius_m.value_or(0) > 0) {
    if (type == CameraType::kPanorama) {
      return refused("a panorama has no lens", "/camera/aperture_radius");
    }
    if (settings.distortion.model == DistortionModel::kFisheye) {
      return refused("depth of field is not available with distortion 'fisheye'",
                     "/camera/aperture_radius");
    }
  }
  return ok_status();
}

Intrinsics intrinsics_of(const CameraSettings& settings, int width, int height) noexcept {
  const double fx = settings.fx_px.value_or(1);
  return {fx, settings.fy_px.value_or(fx), settings.cx_px.value_or(0.5 * width),
          settings.cy_px.value_or(0.5 * height)};
}

Vec2 half_view(const CameraSettings& settings, int width, int height) noexcept {
  if (settings.fx_px) {
    const Intrinsics film = intrinsics_of(settings, width, height);
    return {static_cast<float>(0.5 * width / film.fx), static_cast<float>(0.5 * height / film.fy)};
  }
  constexpr float kUsualFovDegrees = 45;
  const float fov = settings.vertical_fov_degrees.value_or(kUsualFovDegrees) * (kPi / 180);
  const float tan_y = std::tan(fov * 0.5F);
  return {tan_y * (static_cast<float>(width) / static_cast<float>(height)), tan_y};
}

Status check_values(const CameraSettings& settings, int width, int height) {
  if (settings.pose) {
    const CameraSettings& s = settings;
    if (s.position || s.target || s.up) {
      return refused("give either a pose or position, target and up", s.position
                                                                          ? "/camera/position"
                                                                      : s.target ? "/camera/target"
                                                                                 : "/camera/up");
    }
    if (const Status is_rigid = check_pose(*settings.pose); !is_rigid) {
      return is_rigid;
    }
  }
  return settings.fx_px ? check_lens(settings, width, height) : ok_status();
}

}  // namespace core

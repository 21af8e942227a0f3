#include "core/camera/camera.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/camera/camera_choice.h"
#include "core/camera/orbit.h"
#include "core/math/numbers.h"
#include "core/sampling/warp.h"

namespace core {
namespace {

constexpr float kDegree = kPi / 180;
/// Width over depth of a model, below which it is a tenth of a pixel wide in an image of 1000.
constexpr float kFlat = 1e-4F;

}  // namespace

Result<Camera> Camera::create(const CameraSettings& settings,
                              const std::vector<CameraDescription>& cameras, const Bounds& bounds,
                              int width, int height) {
  if (std::vector<Error> faults = view_faults(settings); !faults.empty()) {
    return std::move(faults.front());
  }
  const auto chosen = chosen_camera(settings, cameras);
  if (!chosen) {
    return chosen.error();
  }
  const CameraDescription* file = *chosen;
  if (const Status fits = check_values(settings, width, height); !fits) {
    return fits.error();
  }
  Camera camera;
  camera.width_px_ = static_cast<float>(width);
  camera.height_px_ = static_cast<float>(height);
  const bool posed = settings.is_placed();
  camera.type_ = camera_type(settings, file, posed);
  if (const Status fits = check_members(settings, camera.type_); !fits) {
    return fits.error();
  }
  if (const Status placed = camera.place(settings, file, bounds); !placed) {
    return placed.error();
  }
  camera.aperture_radius_m_ = settings.aperture_radius_m.value_or(0);
  const float distance_m =
      settings.position ? length((*settings.target - *settings.position).rounded())
                        : std::max(dot((bounds.empty() ? Vec3{} : bounds.center()) - camera.eye_,
                                       camera.forward_),
                                   1e-3F * bounds.radius_or(1));
  camera.focus_distance_m_ = settings.focus_distance_m.value_or(distance_m);
  if (camera.type_ == CameraType::kPinhole && settings.distortion.model != DistortionModel::kNone) {
    camera.distortion_.emplace(settings.distortion);
  }
  camera.set_film(camera.intrinsics(settings, posed ? nullptr : file, distance_m));
  if (!posed && !camera.is_sphere() && file != nullptr) {
    camera.set_planes(*file, bounds);
  }
  return camera;
}

Status Camera::place(const CameraSettings& settings, const CameraDescription* file,
                     const Bounds& bounds) {
  Vec3 up_hint = settings.up.value_or(Vec3{0, 1, 0});
  if (settings.pose) {
    eye_ = settings.pose->position().rounded();
    forward_ = settings.pose->forward();
    up_hint = settings.pose->up();
  } else if (settings.position) {
    eye_ = settings.position->rounded();
    forward_ = (*settings.target - *settings.position).rounded();
  } else if (file != nullptr) {
    eye_ = file->to_world.t;
    forward_ = -file->to_world.z;
    up_hint = settings.up.value_or(file->to_world.y);
    if (!(length_squared(forward_) > 0 && length_squared(up_hint) > 0)) {
      return Error{ErrorCode::kInvalidArgument,
                   "the scene's camera '" + file->name +
                       "' has no direction, because its node is scaled to 0",
                   "/camera"};
    }
  } else {
    const Vec3 center = bounds.empty() ? Vec3{} : bounds.center();
    const Vec2 half =
        half_view(settings, static_cast<int>(width_px_), static_cast<int>(height_px_));
    const float distance = fitting_distance_m(bounds.radius_or(1), half);
    // From the front; a model that is flat and seen edge-on from there, from its right.
    const Vec3 size = bounds.empty() ? Vec3{} : bounds.diagonal();
    const bool is_edge_on = size.z > 0 && !(size.x > kFlat * size.z);
    eye_ = center + normalize(is_edge_on ? Vec3{1, 0.25F, 0} : Vec3{0, 0.25F, 1}) * distance;
    forward_ = center - eye_;
  }
  forward_ = normalize(forward_);
  const Vec3 right = cross(forward_, up_hint);
  // Positions were checked in double precision, by view_faults().
  if (!settings.position && !span_view(forward_, up_hint)) {
    return Error{ErrorCode::kInvalidArgument, "up is parallel to the direction of view",
                 "/camera/up"};
  }
  right_ = normalize(right);
  up_ = cross(right_, forward_);
  if (!settings.is_placed() && file != nullptr && file->to_world.determinant() < 0) {
    right_ = -right_;  // glTF 2.0, 3.10: "local +X axis is to the right"
  }
  return ok_status();
}

Intrinsics Camera::intrinsics(const CameraSettings& settings, const CameraDescription* file,
                              float distance_m) const noexcept {
  if (type_ == CameraType::kPinhole) {
    return intrinsics_of(settings, static_cast<int>(width_px_), static_cast<int>(height_px_));
  }
  const auto w = static_cast<double>(width_px_);
  const auto h = static_cast<double>(height_px_);
  Intrinsics film = {1, 1, 0.5 * w, 0.5 * h};
  if (type_ == CameraType::kPanorama) {
    film.fx = w / (2 * std::numbers::pi);
    film.fy = h / std::numbers::pi;
    return film;
  }
  const bool is_of_file = file != nullptr && !file->orthographic;
  const float fov = settings.vertical_fov_degrees ? *settings.vertical_fov_degrees * kDegree
                    : is_of_file                  ? file->vertical_fov_rad
                                                  : 45 * kDegree;
  double half_height = std::tan(static_cast<double>(fov) * 0.5);
  if (settings.orthographic_height_m) {
    half_height = static_cast<double>(*settings.orthographic_height_m) * 0.5;
  } else if (file != nullptr && file->orthographic && is_orthographic()) {
    // Magnifications are half sizes. If the film's aspect ratio differs, the height is kept, as a
    // perspective camera keeps its vertical field of view.
    half_height = static_cast<double>(file->y_magnification);
  } else if (is_orthographic()) {
    half_height *= static_cast<double>(distance_m);
  }
  film.fx = film.fy = 0.5 * h / half_height;
  if (settings.shift) {
    film.cx -= static_cast<double>(settings.shift->x) * w;
    film.cy += static_cast<double>(settings.shift->y) * h;
  }
  return film;
}

void Camera::set_film(Intrinsics film) noexcept {
  const auto w = static_cast<double>(width_px_);
  const auto h = static_cast<double>(height_px_);
  intrinsics_ = film;
  half_width_ = static_cast<float>(0.5 * w / film.fx);
  half_height_ = static_cast<float>(0.5 * h / film.fy);
  middle_ = {static_cast<float>((0.5 * w - film.cx) / film.fx),
             static_cast<float>((film.cy - 0.5 * h) / film.fy)};
}

/// Planes that do not cut the scene are left out, so that a far plane also spares what a job adds.
void Camera::set_planes(const CameraDescription& file, const Bounds& bounds) noexcept {
  if (bounds.empty()) {
    return;
  }
  const auto [nearest, farthest] = extent_along(bounds, eye_, forward_);
  // A near plane behind the whole model is a default of scenes of another size.
  const bool cuts = file.near_m > nearest && file.near_m < farthest;
  near_m_ = cuts ? std::max(file.near_m, 0.0F) : 0.0F;
  depth_m_ = file.far_m < farthest ? file.far_m - near_m_ : Ray{}.t_max;
}

/// Returns the direction, of any length, that the middle of the lens sees at this position.
Vec3 Camera::toward(Vec2 film_px) const noexcept {
  const Vec2 at = plane_position(film_px.x, film_px.y);
  if (type_ == CameraType::kPanorama) {
    return (forward_ * std::cos(at.x) + right_ * std::sin(at.x)) * std::cos(at.y) +
           up_ * std::sin(at.y);
  }
  if (distortion_) {
    const auto seen = [this](Vec2 p) {
      return distortion_->unproject({static_cast<double>(p.x), -static_cast<double>(p.y)});
    };
    Distortion::Unprojected found = seen(at);
    if (!found.is_shown) {  // beyond the film, where filters reach: as at its border
      found = seen(plane_position(std::clamp(film_px.x, 0.0F, width_px_),
                                  std::clamp(film_px.y, 0.0F, height_px_)));
    }
    const Vec3 d = found.direction.rounded();
    return forward_ * d.z + right_ * d.x - up_ * d.y;
  }
  return forward_ + right_ * at.x + up_ * at.y;
}

Camera::CameraRay Camera::ray(Vec2 film_px, Vec2 lens) const noexcept {
  CameraRay out;
  out.film_px = film_px;
  out.start = start_.get();
  if (is_pinhole()) {
    const PinholeRay<float> seen = pinhole_ray(film_px.x, film_px.y);
    out.ray = {seen.origin, seen.direction, 0, seen.t_max};
    out.start_m = seen.start_m;
    out.spread_rad = seen.spread_rad;
    out.width_m = seen.width_m;
    return out;
  }
  if (is_orthographic()) {
    const Vec2 at = plane_position(film_px.x, film_px.y);
    out.ray.origin = eye_ + right_ * at.x + up_ * at.y;
    out.ray.direction = forward_;
    out.width_m = pixel_height();
  } else {
    out.ray.origin = eye_;
    out.ray.direction = normalize(toward(film_px));
    out.spread_rad = pixel_height();
  }
  if (is_sphere()) {
    return out;
  }
  if (aperture_radius_m_ > 0) {
    const float to_plane = focus_distance_m_ / dot(out.ray.direction, forward_);
    const Vec3 focus = out.ray.origin + out.ray.direction * to_plane;
    const Vec2 d = concentric_disk(lens) * aperture_radius_m_;
    out.ray.origin += right_ * d.x + up_ * d.y;
    out.ray.direction = normalize(focus - out.ray.origin);
  }
  if (near_m_ > 0 || depth_m_ < Ray{}.t_max) {
    const float cosine = dot(out.ray.direction, forward_);
    out.start_m = near_m_ / cosine;
    out.ray.origin += out.ray.direction * out.start_m;
    out.ray.t_max = std::min(depth_m_ / cosine, Ray{}.t_max);
    out.width_m += out.spread_rad * out.start_m;
  }
  return out;
}

/// x to the right and y up, in the unit of half_width_.
Vec2 Camera::film_position(float x, float y) const noexcept {
  return {0.5F * width_px_ * ((x - middle_.x) / half_width_ + 1),
          0.5F * height_px_ * (1 - (y - middle_.y) / half_height_)};
}

/// Pixels per unit of half_width_, squared.
float Camera::pixels_per_area() const noexcept {
  return width_px_ * height_px_ / (4 * half_width_ * half_height_);
}

float Camera::lens_area_m2() const noexcept { return kPi * square(aperture_radius_m_); }

Camera::Importance Camera::importance(Vec3 origin, Vec3 direction) const noexcept {
  Importance out;
  if (type_ == CameraType::kPanorama) {
    const float ahead = dot(direction, forward_);
    const float aside = dot(direction, right_);
    const float level = std::sqrt(square(ahead) + square(aside));  // cosine of the latitude
    if (!(level > 0)) {
      return out;  // a pole: a whole row of the film, not a point
    }
    out.film_px = film_position(std::atan2(aside, ahead), std::atan2(dot(direction, up_), level));
    out.pdf_area = 1;
    out.pdf_solid_angle = pixels_per_area() / level;
    out.we = out.pdf_solid_angle;
    return out;
  }
  if (is_fisheye()) {
    const auto shown = distortion_->project({static_cast<double>(dot(direction, right_)),
                                             -static_cast<double>(dot(direction, up_)),
                                             static_cast<double>(dot(direction, forward_))});
    if (shown) {
      out.film_px =
          film_position(static_cast<float>(shown->at.x), -static_cast<float>(shown->at.y));
      out.pdf_area = 1;
      out.pdf_solid_angle = pixels_per_area() * static_cast<float>(shown->scale);
      out.we = out.pdf_solid_angle;
    }
    return out;
  }
  const float cosine = dot(direction, forward_);
  if (!(cosine > 0)) {
    return out;
  }
  // The ray meets the plane of focus at `at`, which is f (x, y) from the axis of a perspective
  // camera and (x, y) from that of an orthographic one. From a point of the lens, areas da of that
  // plane are solid angles da cos^3 / f^2.
  const bool has_lens = aperture_radius_m_ > 0;
  const float f = has_lens ? focus_distance_m_ : 1.0F;
  const Vec3 from_eye = origin - eye_;
  const Vec3 at = from_eye + direction * ((f - dot(from_eye, forward_)) / cosine);
  const float unit = is_orthographic() ? 1.0F : f;
  Vec2 on_film = {dot(at, right_) / unit, dot(at, up_) / unit};
  float scale = 1;
  if (distortion_) {
    const auto shown =
        distortion_->project({static_cast<double>(on_film.x), -static_cast<double>(on_film.y), 1});
    if (!shown) {
      return out;
    }
    on_film = {static_cast<float>(shown->at.x), -static_cast<float>(shown->at.y)};
    scale = static_cast<float>(shown->scale);
  }
  out.film_px = film_position(on_film.x, on_film.y);
  const float per_solid_angle = f * f / (cosine * cosine * cosine);
  if (is_orthographic()) {
    // A point of the film maps to a point in focus: its rays diverge over the lens, and the lens
    // moves with the point.
    out.pdf_area = pixels_per_area();
    out.pdf_solid_angle = has_lens ? per_solid_angle / lens_area_m2() : 1.0F;
  } else {
    out.pdf_area = has_lens ? 1 / lens_area_m2() : 1.0F;
    out.pdf_solid_angle = pixels_per_area() * scale * per_solid_angle / (f * f);
  }
  out.we = out.pdf_area * out.pdf_solid_angle / cosine;
  return out;
}

Camera::ImportanceSample Camera::sample_wi(Vec3 point, Vec2 lens) const noexcept {
  ImportanceSample out = seen_without_planes(point, lens);
  if (near_m_ > 0 || depth_m_ < Ray{}.t_max) {
    const float depth = dot(point - eye_, forward_) - near_m_;
    if (depth < 0 || depth > depth_m_) {
      out.pdf_solid_angle = 0;
    } else if (out.pdf_solid_angle > 0) {
      out.origin += out.wi_world * (near_m_ / dot(out.wi_world, forward_));
    }
  }
  return out;
}

Camera::ImportanceSample Camera::seen_without_planes(Vec3 point, Vec2 lens) const noexcept {
  ImportanceSample out;
  const Vec3 from_eye = point - eye_;
  if (is_sphere()) {
    out.distance_m = length(from_eye);
    if (!(out.distance_m > 0)) {
      return out;
    }
    out.wi_world = -from_eye * (1 / out.distance_m);
    out.origin = eye_;
    out.importance = importance(eye_, -out.wi_world);
    out.pdf_solid_angle = out.importance.we > 0 ? square(out.distance_m) : 0.0F;
    return out;
  }
  const float depth = dot(from_eye, forward_);
  if (!(depth > 0)) {
    return out;
  }
  Vec3 on_lens;
  if (aperture_radius_m_ > 0) {
    const Vec2 d = concentric_disk(lens) * aperture_radius_m_;
    on_lens = right_ * d.x + up_ * d.y;
  }
  if (is_orthographic()) {
    // The ray from a point `on_lens` off the axis meets the axis in focus.
    on_lens = from_eye - forward_ * depth + on_lens * (depth / focus_distance_m_);
  }
  const Vec3 to_camera = on_lens - from_eye;
  out.distance_m = length(to_camera);
  out.wi_world = to_camera * (1 / out.distance_m);
  out.origin = eye_ + on_lens;
  out.importance = importance(out.origin, -out.wi_world);
  out.pdf_solid_angle = is_orthographic()
                            ? out.importance.pdf_solid_angle
                            : area_to_solid_angle(out.importance.pdf_area, square(out.distance_m),
                                                  -dot(out.wi_world, forward_));
  return out;
}

std::optional<Vec2> Camera::project(Vec3 point, Vec2 lens) const noexcept {
  const ImportanceSample seen = seen_without_planes(point, lens);
  return seen.pdf_solid_angle > 0 ? std::optional(seen.importance.film_px) : std::nullopt;
}

}  // namespace core

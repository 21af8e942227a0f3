#include "core/render/picture/camera_start.h"

#include <algorithm>
#include <memory>
#include <vector>

#include "core/scene/solids.h"

namespace core {
namespace {

struct Start {
  Vec3 origin;
  float time = 0;
};

/// Origins of rays from the corners and the middle of the film, on the edge and in the middle of
/// the lens, at several times.
std::vector<Start> sampled_starts(const MovingCamera& camera, Vec2 film_px, bool is_moving) {
  // The edge of the lens is that of the unit square (concentric map).
  constexpr float kLast = 0x1.fffffep-1F;
  constexpr float kLens[][2] = {
      {0.5F, 0.5F},   {0, 0},         {0.25F, 0},     {0.5F, 0},     {0.75F, 0},     {kLast, 0},
      {0, 0.25F},     {0, 0.5F},      {0, 0.75F},     {0, kLast},    {kLast, 0.25F}, {kLast, 0.5F},
      {kLast, 0.75F}, {kLast, kLast}, {0.25F, kLast}, {0.5F, kLast}, {0.75F, kLast}};
  constexpr int kTimes = 8;
  std::vector<Start> out;
  for (int k = 0; k <= (is_moving ? kTimes : 0); ++k) {
    const float time = static_cast<float>(k) / kTimes;
    for (const Vec2 at : {Vec2{0.5F, 0.5F}, Vec2{0, 0}, Vec2{1, 0}, Vec2{0, 1}, Vec2{1, 1}}) {
      for (const auto& lens : kLens) {
        const Vec2 on_film = {at.x * film_px.x, at.y * film_px.y};
        const Vec3 origin = is_moving ? camera.ray(on_film, {lens[0], lens[1]}, time).ray.origin
                                      : camera.first().ray(on_film, {lens[0], lens[1]}).ray.origin;
        const bool is_new = std::none_of(out.begin(), out.end(), [&](const Start& s) {
          return s.origin == origin && s.time == time;
        });
        if (is_new) {
          out.push_back({origin, time});
        }
      }
    }
  }
  return out;
}

}  // namespace

void place_in_solids(MovingCamera& camera, const SceneData& scene, Vec2 film_px, bool is_moving) {
  if (scene.solids.empty()) {
    return;
  }
  const std::vector<Start> starts = sampled_starts(camera, film_px, is_moving);
  StartMedia start{solids_around(scene, starts.front().origin, starts.front().time), false};
  start.varies = std::any_of(starts.begin() + 1, starts.end(), [&](const Start& s) {
    return !(solids_around(scene, s.origin, s.time) == start.media);
  });
  if (camera.first().is_orthographic() || is_moving) {
    Bounds box;
    for (const Start& s : starts) {
      box.add(s.origin);
    }
    start.varies =
        start.varies || std::any_of(scene.solids.begin(), scene.solids.end(), [&](const Solid& s) {
          return s.kind != SolidKind::kOpen && overlap(s.box, box);
        });
  }
  if (start.varies || !start.media.empty()) {
    camera.start_in(std::make_shared<const StartMedia>(start));
  }
}

}  // namespace core

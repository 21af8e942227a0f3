/// Ledgers: where else than in the picture a path's light is noted.
///
/// A policy of PathTracer's options. NoLedger is empty, so that the default path has no trace of
/// it; LightLedger sorts what paths find into the film's shares of the light.
#pragma once

#include <algorithm>
#include <vector>

#include "core/integrators/integrator.h"

namespace core {

struct NoLedger {
  explicit NoLedger(const IntegratorInput&) {}
  template <typename Group>
  void add(Rgb*, Rgb, int, Group&&) const noexcept {}
};

class LightLedger {
 public:
  explicit LightLedger(const IntegratorInput& input) {
    const auto& groups = input.scene.light_groups;
    for (const LightShare& share : input.settings.film.shares) {
      const auto found =
          share.group ? std::find(groups.begin(), groups.end(), *share.group) : groups.end();
      rows_.push_back({share.first_bounce, share.last_bounce, share.group.has_value(),
                       static_cast<std::uint32_t>(found - groups.begin())});
    }
  }
  /// to: one sum for each share; null: not asked for. scatterings: of the path from the light to
  /// the camera. group(): number of the light's group.
  template <typename Group>
  void add(Rgb* to, Rgb value, int scatterings, Group&& group) const noexcept {
    if (to == nullptr || is_black(value)) {
      return;
    }
    const std::uint32_t from = group();
    for (const Row& row : rows_) {
      const bool is_in = scatterings >= row.first && scatterings <= row.last &&
                         (!row.has_group || row.group == from);
      if (is_in) {
        *to += value;
      }
      ++to;
    }
  }

 private:
  struct Row {
    int first = 0;
    int last = 0;
    bool has_group = false;
    std::uint32_t group = 0;
  };
  std::vector<Row> rows_;
};

}  // namespace core

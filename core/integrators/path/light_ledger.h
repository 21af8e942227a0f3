/// Ledgers: sort the light of a path into the film's shares, besides the image.
///
/// A policy of PathTracer's options. NoLedger is empty, so the default path has no extra code;
/// LightLedger adds contributions to the film's shares of the light.
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

/// Properties of a contribution by which the ledger sorts it.
struct LightOrigin {
  int scatterings = 0;      ///< on the path from the light to the camera
  std::uint32_t group = 0;  ///< index of the light's group
  SubpathLengths strategy{};
};

class LightLedger {
 public:
  explicit LightLedger(const IntegratorInput& input) {
    const auto& groups = input.scene.light_groups;
    for (const LightShare& share : input.settings.film.shares) {
      const auto found =
          share.group ? std::find(groups.begin(), groups.end(), *share.group) : groups.end();
      rows_.push_back({share, static_cast<std::uint32_t>(found - groups.begin())});
    }
  }
  bool empty() const noexcept { return rows_.empty(); }
  /// to: one sum per share; null if shares are not recorded. group(): as in LightOrigin.
  template <typename Group>
  void add(Rgb* to, Rgb value, int scatterings, Group&& group) const noexcept {
    if (to == nullptr || is_black(value)) {
      return;
    }
    each({scatterings, group()}, [to, value](std::size_t i, bool) { to[i] += value; });
  }
  /// Calls visit(share, is_weighted) for each share that includes light of this origin.
  template <typename Visit>
  void each(const LightOrigin& from, Visit&& visit) const {
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      const LightShare& share = rows_[i].share;
      const bool is_in = !share.is_irradiance && from.scatterings >= share.first_bounce &&
                         from.scatterings <= share.last_bounce &&
                         (!share.group || rows_[i].group == from.group) &&
                         (!share.strategy || *share.strategy == from.strategy);
      if (is_in) {
        visit(i, share.is_weighted);
      }
    }
  }

 private:
  struct Row {
    LightShare share;
    std::uint32_t group = 0;
  };
  std::vector<Row> rows_;
};

}  // namespace core

/// fill_tile: selects the next samples of a tile and adds them to its statistics.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <span>
#include <stop_token>
#include <vector>

#include "core/base/check.h"
#include "core/color/rgb.h"
#include "core/film/due_sample.h"
#include "core/film/film.h"
#include "core/samplers/hash.h"

namespace core {

/// Updates mean and sum of squared deviations of the luminance (Welford).
inline void add_sample(ReplicatePixel& p, const PathSample& s) {
  ++p.count;
  const float w = 1 / static_cast<float>(p.count);
  const Rgb before = {p.mean_r, p.mean_g, p.mean_b};
  const Rgb after = before + (s.radiance - before) * w;
  // A radiance of 1e20 is rare, but its square overflows a float: clamp to the largest float.
  p.m2_luminance =
      std::min(p.m2_luminance + luminance(s.radiance - before) * luminance(s.radiance - after),
               std::numeric_limits<float>::max());
  p.mean_r = after.r;
  p.mean_g = after.g;
  p.mean_b = after.b;
  p.mean_alpha += (s.alpha - p.mean_alpha) * w;
}

inline void add_auxiliary(AuxPixel& p, const PathSample& s) {
  if (!s.hit) {
    return;
  }
  ++p.hits;
  const float w = 1 / static_cast<float>(p.hits);
  p.albedo = p.albedo + (s.albedo - p.albedo) * w;
  p.normal_world = p.normal_world + (s.normal_world - p.normal_world) * w;
  p.depth_m += (s.depth_m - p.depth_m) * w;
}

inline void add_pilot(PilotPixel& p, Rgb radiance, float rays) {
  ++p.count;
  const float w = 1 / static_cast<float>(p.count);
  const Rgb before = p.mean;
  p.mean = before + (radiance - before) * w;
  p.m2 = p.m2 + (radiance - before) * (radiance - p.mean);
  p.rays += (rays - p.rays) * w;
}

/// Adds the fitted control variate to the sample's radiance, and the sample to the fit. fits: those
/// of the pixel. count: samples of the replicate so far.
inline void apply_fit(std::span<ReplicateFit> fits, std::size_t replicate, std::uint32_t count,
                      FitType type, PathSample& s) {
  if (replicate % 2 == 0 && fit_is_due(count)) {
    ReplicateFit& a = fits[replicate];
    ReplicateFit& b = fits[replicate + 1];
    a.coefficient = fitted_coefficient(type, b);
    b.coefficient = fitted_coefficient(type, a);
  }
  s.radiance += fits[replicate].coefficient * s.fit.control;
  fits[replicate].add(s.fit);
}

/// Adds sample `s` of a pixel to the tile's statistics.
inline void add_to_tile(TileState& state, int replicates, std::size_t pixel, int s,
                        const PathSample& sample) {
  const auto r = static_cast<std::size_t>(replicates);
  add_sample(state.pixels[pixel * r + static_cast<std::size_t>(s) % r], sample);
  if (!state.aux.empty()) {
    add_auxiliary(state.aux[pixel], sample);
  }
}

struct FillRule {
  int replicates = 2;
  int step = 1;  ///< plan_step()
  FitType fit = FitType::kNone;
  int history = 1;  ///< consecutive samples of a replicate that are traced together
};

/// Calls take(pixel, x, y, sample) for every sample from first_sample to last_sample of the tile,
/// in the order of the plan. Returns false if stop was requested.
template <typename Take>
bool visit_samples(const TileState& state, const FillRule& rule, int first_sample, int last_sample,
                   const std::stop_token& stop, Take&& take) {
  std::size_t pixel = 0;
  for (int y = state.rect.y; y < state.rect.y + state.rect.height; ++y) {
    if (stop.stop_requested()) {
      return false;
    }
    for (int x = state.rect.x; x < state.rect.x + state.rect.width; ++x, ++pixel) {
      if (state.plan.empty()) {
        for (int s = first_sample; s < last_sample; ++s) {
          take(pixel, x, y, s);
        }
        continue;
      }
      const PixelPlan& plan = state.plan[pixel];
      const PlanPosition at = {state.span, rule.step, x, y};
      std::uint32_t has = planned_count(plan, at, first_sample);
      // Advances one step of the mean at a time, so that the order does not depend on slices.
      for (int s = first_sample + 1; s <= last_sample; ++s) {
        const std::uint32_t want = planned_count(plan, at, s);
        for (const int half : {0, 1}) {
          for (std::uint32_t k = has; k < want; ++k) {
            take(pixel, x, y, sample_of_half(k, rule.replicates, half));
          }
        }
        has = want;
      }
    }
  }
  return true;
}

/// Adds the samples from state.samples to last_sample of every pixel, in the order of the plan.
/// trace(x, y, sample) returns the PathSample of a pixel of the full film. Returns false, leaving
/// `state` incomplete, if stop was requested.
template <typename Trace>
bool fill_tile(TileState& state, const FillRule& rule, int last_sample, const std::stop_token& stop,
               Trace&& trace) {
  const auto r = static_cast<std::size_t>(rule.replicates);
  if (rule.fit != FitType::kNone) {
    state.fit.resize(state.pixels.size());
  }
  const auto take = [&](std::size_t pixel, int x, int y, int s) {
    PathSample sample = trace(x, y, s);
    if (rule.fit != FitType::kNone) {
      const auto replicate = static_cast<std::size_t>(s) % r;
      apply_fit(std::span(state.fit).subspan(pixel * r, r), replicate,
                state.pixels[pixel * r + replicate].count, rule.fit, sample);
    }
    add_to_tile(state, rule.replicates, pixel, s, sample);
  };
  if (!visit_samples(state, rule, state.samples, last_sample, stop, take)) {
    return false;
  }
  state.samples = last_sample;
  return true;
}

/// As fill_tile(), for independent paths traced `wave` at a time, one sample of each pixel after
/// the other. trace(due) traces; result(due[i], i) then returns the PathSample of due[i]. The
/// content does not depend on `wave`, because each pixel gets its samples in the order of the plan.
/// Does not support fits.
template <typename Trace, typename Result>
bool fill_tile_in_waves(TileState& state, const FillRule& rule, std::size_t wave, int last_sample,
                        const std::stop_token& stop, Trace&& trace, Result&& result) {
  CHECK(wave > 0);
  std::vector<DueSample> due;
  due.reserve(wave);
  const auto flush = [&] {
    trace(std::span<const DueSample>(due));
    for (std::size_t i = 0; i < due.size(); ++i) {
      const PathSample sample = result(due[i], i);
      add_to_tile(state, rule.replicates, due[i].pixel, due[i].sample, sample);
    }
    due.clear();
  };
  for (int s = state.samples; s < last_sample; ++s) {
    std::size_t pixel = 0;
    for (int y = state.rect.y; y < state.rect.y + state.rect.height; ++y) {
      for (int x = state.rect.x; x < state.rect.x + state.rect.width; ++x, ++pixel) {
        const auto take = [&](int sample) {
          due.push_back({x, y, sample, pixel});
          if (due.size() == wave) {
            flush();
          }
        };
        if (state.plan.empty()) {
          take(s);
          continue;
        }
        const PixelPlan& plan = state.plan[pixel];
        const PlanPosition at = {state.span, rule.step, x, y};
        const std::uint32_t has = planned_count(plan, at, s);
        const std::uint32_t want = planned_count(plan, at, s + 1);
        for (const int half : {0, 1}) {
          for (std::uint32_t k = has; k < want; ++k) {
            take(sample_of_half(k, rule.replicates, half));
          }
        }
      }
      if (stop.stop_requested()) {
        return false;
      }
    }
  }
  flush();
  state.samples = last_sample;
  return true;
}

/// A group of samples traced together: from every pixel of a square one sample, or `history`
/// consecutive samples of one replicate.
struct GroupTurn {
  int step = 0;          ///< mean sample count: from step to step + 1
  int first_sample = 0;  ///< of the slice
  int last_sample = 0;
  int half = 0;  ///< with a plan: group `round` of the samples that this half of the pixels gets in
                 ///< this step
  std::uint32_t round = 0;
};

/// Finds the samples of the pixels of `cell` that are due in this turn, ordered by pass. Clears
/// `due` first. Without a plan, windows begin at multiples of history * replicates samples, and a
/// window is due with the first sample of its replicate. With a plan, every step of a pixel
/// consists of complete windows.
inline void find_due(const TileState& state, const FillRule& rule, PixelRect cell,
                     const GroupTurn& turn, std::vector<DueSample>& due) {
  due.clear();
  const int window = rule.history * rule.replicates;
  const int begin = turn.step / window * window;
  const bool is_first = turn.half == 0 && turn.round == 0 &&
                        turn.step - rule.replicates < std::max(begin, turn.first_sample);
  if (state.plan.empty() && !is_first) {
    return;
  }
  const auto per = static_cast<std::uint32_t>(rule.replicates) / 2;
  const auto passes = static_cast<std::uint32_t>(rule.history);
  // Rounds go through the replicates of the half, then to their next windows.
  const std::uint32_t replicate = turn.round % per;
  const std::uint32_t windows_begin = turn.round / per * (per * passes);
  for (std::uint32_t pass = 0; pass < passes; ++pass) {
    const int sample = turn.step + static_cast<int>(pass) * rule.replicates;
    for (int y = cell.y; y < cell.y + cell.height; ++y) {
      for (int x = cell.x; x < cell.x + cell.width; ++x) {
        const auto pixel = static_cast<std::size_t>(y - state.rect.y) *
                               static_cast<std::size_t>(state.rect.width) +
                           static_cast<std::size_t>(x - state.rect.x);
        if (state.plan.empty()) {
          if (sample < std::min(begin + window, turn.last_sample)) {
            due.push_back({x, y, sample, pixel});
          }
          continue;
        }
        const PlanPosition at = {state.span, rule.step, x, y};
        const std::uint32_t k = planned_count(state.plan[pixel], at, turn.step) + windows_begin +
                                pass * per + replicate;
        if (k < planned_count(state.plan[pixel], at, turn.step + 1)) {
          due.push_back({x, y, sample_of_half(k, rule.replicates, turn.half), pixel});
        }
      }
    }
  }
}

/// As fill_tile(), for paths traced in groups: the pixels of squares of `block` by `block`, clipped
/// to the tile, each with rule.history samples of the same replicate. The squares are shifted from
/// group to group. trace(due, each, samples) returns the PathSamples of a group with `each` samples
/// per pixel. Squares and groups depend on the job, the tile and the sample, not on the slice,
/// provided that slices end at the ends of windows (shared_window()).
template <typename Trace>
bool fill_tile_in_groups(TileState& state, const FillRule& rule, int block, int last_sample,
                         const std::stop_token& stop, Trace&& trace) {
  std::vector<DueSample> due;
  std::vector<PathSample> samples;
  const PixelRect& tile = state.rect;
  const int right = tile.x + tile.width;
  const int bottom = tile.y + tile.height;
  for (int s = state.samples; s < last_sample; ++s) {
    if (stop.stop_requested()) {
      return false;
    }
    for (const int half : {0, 1}) {
      bool any = true;
      for (std::uint32_t round = 0; any; ++round) {
        any = false;
        const std::uint64_t h = mix_bits((static_cast<std::uint64_t>(s) << 32) | (round << 1) |
                                         static_cast<std::uint32_t>(half));
        const auto side = static_cast<std::uint64_t>(block);
        const int left = tile.x - tile.x % kTileSize - static_cast<int>((h & 0xFFFFFFU) % side);
        const int top =
            tile.y - tile.y % kTileSize - static_cast<int>(((h >> 24) & 0xFFFFFFU) % side);
        for (int y = top; y < bottom; y += block) {
          for (int x = left; x < right; x += block) {
            PixelRect cell = {std::max(x, tile.x), std::max(y, tile.y), 0, 0};
            cell.width = std::min(x + block, right) - cell.x;
            cell.height = std::min(y + block, bottom) - cell.y;
            find_due(state, rule, cell, {s, state.samples, last_sample, half, round}, due);
            if (due.empty()) {  // includes squares outside the crop
              continue;
            }
            any = true;
            samples.resize(due.size());
            const auto each = std::count_if(due.begin(), due.end(), [&](const DueSample& d) {
              return d.pixel == due[0].pixel;
            });
            trace(std::span<const DueSample>(due), static_cast<int>(each),
                  std::span<PathSample>(samples));
            for (std::size_t i = 0; i < due.size(); ++i) {
              add_to_tile(state, rule.replicates, due[i].pixel, due[i].sample, samples[i]);
            }
          }
        }
      }
    }
  }
  state.samples = last_sample;
  return true;
}

/// Adds the pilot samples from state.pilot_samples to last_sample of every pixel. trace(x, y,
/// sample, rays) returns the radiance and adds to the ray count. Returns false if stop was
/// requested.
template <typename Trace>
bool fill_pilot(TileState& state, int last_sample, const std::stop_token& stop, Trace&& trace) {
  state.pilot.resize(static_cast<std::size_t>(state.rect.width) *
                     static_cast<std::size_t>(state.rect.height));
  std::size_t pixel = 0;
  for (int y = state.rect.y; y < state.rect.y + state.rect.height; ++y) {
    if (stop.stop_requested()) {
      return false;
    }
    for (int x = state.rect.x; x < state.rect.x + state.rect.width; ++x, ++pixel) {
      for (int s = state.pilot_samples; s < last_sample; ++s) {
        std::uint64_t rays = 0;
        const Rgb radiance = trace(x, y, s, rays);
        add_pilot(state.pilot[pixel], radiance, static_cast<float>(rays));
        state.rays += rays;
      }
    }
  }
  state.pilot_samples = last_sample;
  return true;
}

}  // namespace core

/// LaneTracer: the tracer of waves. Only wave_tracer.cpp includes it and the headers of its steps,
/// lane_fog.h and lane_shadows.h, so that all of it is compiled as one.
#pragma once

#include <algorithm>
#include <bit>
#include <type_traits>
#include <utility>

#include "core/integrators/path/light_candidates.h"
#include "core/integrators/path/path_tracer.h"
#include "core/math/frame.h"
#include "core/math/offset_ray.h"
#include "core/samplers/dimensions.h"
#include "core/samplers/sobol.h"
#include "core/sampling/mis.h"
#include "core/sampling/reservoir.h"
#include "core/transport/medium_sample.h"
#include "core/transport/roulette.h"
#include "core/transport/visibility.h"
#include "core/wave/lane_camera.h"
#include "core/wave/lane_catcher.h"
#include "core/wave/lane_holes.h"
#include "core/wave/lane_lights.h"
#include "core/wave/lane_spectrum.h"
#include "core/wave/lane_surfaces.h"
#include "core/wave/scalar_paths.h"
#include "core/wave/wave_access.h"
#include "core/wave/wave_tracer.h"

namespace core {
namespace {

// The rule that the lanes use.
static_assert(DefaultOptions::mis.type == MisType::kPower && DefaultOptions::mis.exponent == 2);

/// Of WaveShadows' slots: the sample counts where the model blocks it.
inline constexpr std::int32_t kIsBlocked = 1 << 30;

/// PathTracer<Options>, step by step, for the paths of a wave. Options: DefaultOptions, or
/// WholeOptions with the same estimators but for the number of light candidates.
template <std::size_t N, typename Options>
class LaneTracer final : public WaveTracer {
 public:
  explicit LaneTracer(const IntegratorInput& input)
      : scene_(input.scene),
        environment_(input.environment),
        backdrop_(input.settings.background, input.environment),
        max_depth_(input.settings.max_depth),
        split_count_(Options(input.settings).split_count),
        share_(1 / static_cast<float>(split_count_)),
        is_sobol_(input.settings.sampler == SamplerType::kSobol),
        share_count_(kHasLedger ? input.settings.film.shares.size() : 0),
        has_alpha_weights_(input.settings.film.errors_over_white),
        scalar_(input),
        ledger_(input),
        catcher_(input),
        scalar_paths_(scalar_, catcher_.scalar()),
        fog_(scalar_.fog()),
        lights_(scene_, scalar_.lights()),
        surfaces_(scene_, !Options::is_spectral && !has_fog()),
        is_open_(input.settings.shutter_seconds > 0),
        moves_(is_open_ && std::any_of(scene_.meshes.begin(), scene_.meshes.end(),
                                       [](const MeshData& mesh) { return !mesh.later.empty(); })),
        has_exceptions_(scene_.has_alpha || catcher_.scalar() != nullptr) {}

  std::size_t samples_max() const noexcept override {
    const std::size_t most = samples_of_wave(split_count_);
    // A chunk on the catcher is compacted in two parts. Of n paths that split, the first
    // continuations take the places of the n themselves, so that there is room.
    return catcher_.is_in_lanes() && split_count_ == 1 ? most - 8 : most;
  }
  void begin(Wave& wave, const WaveStart& start, std::span<const DueSample> due) const override;
  void trace(Wave& wave, std::uint64_t& rays, std::uint64_t& rejected) const noexcept override {
    for (int depth = 0; wave.paths.count > 0 || !wave.waiting.empty(); ++depth) {
      scalar_paths_.take_back(wave, depth);
      find_hits(wave, depth, rays);
      // Camera paths stay in the order of their slots; in fog, paths without a hit go on.
      if (depth > 0 && !has_fog()) {
        close_gaps(wave);
      }
      const std::size_t end = wave.paths.first + wave.paths.count;
      wave.paths.count = 0;
      for (std::size_t first = std::exchange(wave.paths.first, 0); first < end; first += N) {
        const unsigned met = wave.hits.is_hit.at[first / 8] >> (first % 8) & ((1U << N) - 1);
        if (has_fog()) {
          advance(wave, first, met, lanes_below(end - first) & ((1U << N) - 1), depth, rays);
        } else if (met != 0) {
          advance(wave, first, met, met, depth, rays);
        }
      }
      find_lights(wave, depth, rays);
    }
    add_continuations(wave);
    catcher_.end(wave);
    rejected += apply_filter_weights<N>(wave.results, wave.samplers.size(), has_alpha_weights_);
  }

 private:
  using Colors = std::conditional_t<Options::is_spectral, SpectrumLanes<N>, RgbLanes<N>>;
  /// As LastScattering.
  struct Last {
    Floats<N> pdf_bsdf;
    Vec3s<N> origin;
    Vec3s<N> normal;
  };
  /// The surface vertices of one chunk of lanes.
  struct Vertex {
    LaneHits<N> met;
    Vec3s<N> wo_world;
    Vec3s<N> beta;
    FrameOf<Floats<N>> frame;
    Mask<N> on;
    Floats<N> cone_spread_rad;
    Ints<N> is_sharp;
    Ints<N> medium_scatterings;
    Ints<N> null_scatterings;
    Ints<N> medium;
    Last last;                     ///< valid if there are walls
    Mask<N> may_scatter;           ///< the others pass walls only; valid if there are walls
    const Vec3s<N>* light_normal;  ///< as of LastScattering
    Vec3s<N> normal_or_none;       ///< zero where light comes from both sides
    Colors colors;

    [[gnu::always_inline]] BsdfLanes<N> bsdf() const {
      return BsdfLanes<N>(met.surface, frame.to_local(wo_world),
                          frame.to_local(met.surface.horizon),
                          {.layers = met.layered == 0 ? nullptr : &met.layers,
                           .solids = met.solid == 0 ? nullptr : &met.solids,
                           .walls = met.wall == 0 ? nullptr : &met.walls,
                           .brush = met.brushed == 0 ? nullptr : &met.brush,
                           .films = met.films.on == 0 ? nullptr : &met.films});
    }
  };
  using Numbers = PathNumbers<N>;
  /// Light samples without shadow, which add value * scale.
  struct Unshadowed {
    LightLanes<N> light;
    Vec3s<N> value;
    Floats<N> scale;
    Mask<N> lit;
  };
  static constexpr bool kHasLedger = !std::is_same_v<typename Options::Ledger, NoLedger>;
  static constexpr bool kIsDefault = std::is_same_v<Options, DefaultOptions>;

  int candidates() const { return scalar_.options().candidates; }
  /// Density of all light samples of a surface, for MIS.
  template <typename F>
  F of_all(F pdf) const {
    if constexpr (kIsDefault) {
      return pdf;
    } else {
      return pdf * F(static_cast<float>(candidates()));
    }
  }
  Rgb* shares_of(Wave& wave, std::int32_t slot) const {
    return share_count_ > 0 ? &wave.shares[sum_of(slot) * share_count_] : nullptr;
  }
  /// As PathTracer::credit().
  template <typename Group>
  void credit(Wave& wave, std::int32_t slot, Vec3 value, int scatterings, Group&& group) const {
    if constexpr (Options::is_spectral) {
      const Rgb color = wave.wavelengths[sample_of(slot)].color({value.x, value.y, value.z});
      value = {color.r, color.g, color.b};
    }
    add_radiance(wave.results, slot, value);
    if constexpr (kHasLedger) {
      ledger_.add(shares_of(wave, slot), {value.x, value.y, value.z}, scatterings, group);
    }
  }

  void add_continuations(Wave& wave) const;
  void fill_rays(TracedPacket& packet, const Wave& wave, std::size_t first, unsigned active,
                 int depth) const;
  void find_hits(Wave& wave, int depth, std::uint64_t& rays) const;
  [[gnu::noinline]] void pass_holes(Wave& wave, int depth, std::uint64_t& rays) const;
  void end_paths(Wave& wave, std::size_t first, unsigned active, unsigned met, bool has_sky,
                 int depth) const;
  void find_lights(Wave& wave, int depth, std::uint64_t& rays) const;
  void close_gaps(Wave& wave) const;
  [[gnu::always_inline]] void move(const WaveFront& from, std::size_t first, unsigned taken,
                                   WaveFront& to) const;
  Vec3s<N> found_environment(const Wave& wave, std::size_t first, unsigned left) const;
  void add_environment(Wave& wave, std::size_t first, unsigned left, int depth) const;
  [[gnu::always_inline]] void add_paths(WavePaths& paths, const PathLanes<N>& next,
                                        unsigned taken) const {
    const std::size_t to = paths.count;
    for_each_member<Options::has_media>(
        scene_.has_clear, [&](auto member) __attribute__((always_inline)) {
          compress(member(paths), to, member(next), taken);
        });
    paths.count += static_cast<std::size_t>(std::popcount(taken));
  }
  /// Light samples from `origin`, for WaveShadows.
  struct Shadows {
    Vec3s<N> origin;
    const LightLanes<N>& light;
    Vec3s<N> value;
    Floats<N> cone_width_m;
    Ints<N> is_sharp;
    Ints<N> slot;
    Ints<N> medium;
    Ints<N> null_scatterings;
  };
  [[gnu::always_inline]] void add_shadows(Wave& wave, const Shadows& of, unsigned taken) const;
  template <typename Group>
  void add_emission(Wave& wave, std::size_t i, const LaneHits<N>& met, std::size_t lane,
                    Group&& group, int depth) const;
  [[gnu::noinline]] void keep_away(Wave& wave, std::size_t first, unsigned met) const;
  [[gnu::noinline]] void catch_light(Wave& wave, const Vertex& at, const BsdfLanes<N>& bsdf,
                                     const Numbers& numbers) const;
  void leave_lanes(Wave& wave, std::size_t i, const RawHit* met, int depth,
                   std::uint64_t& rays) const;
  const Solid& solid_of(std::int32_t medium) const {
    return scene_.solids[static_cast<std::size_t>(medium) - 1];
  }
  /// Returns the medium of paths `through` the surface, or not.
  Ints<N> medium_beyond(const Vertex& at, Mask<N> through) const {
    return at.met.solid == 0
               ? at.medium
               : select(through & Mask<N>::of(at.met.solid), at.met.beyond, at.medium);
  }
  [[gnu::noinline]] void absorb(Wave& wave, std::size_t first, unsigned on,
                                Floats<N> distance_m) const;
  [[gnu::noinline]] Floats<N> eta_scale(Mask<N> on, Ints<N> medium) const;
  void advance(Wave& wave, std::size_t first, unsigned met, unsigned active, int depth,
               std::uint64_t& rays) const;
  struct FogVertex;
  [[gnu::noinline]] FogVertex pass_fog(Wave& wave, std::size_t first, unsigned& met, unsigned left,
                                       const SegmentLanes<N>& segments, const LaneHits<N>& hits,
                                       int depth) const;
  [[gnu::noinline]] void thin_in_fog(WaveShadows& shadows, std::size_t first, unsigned on) const;
  void scatter_in_fog(Wave& wave, const FogVertex& at, int depth) const;
  /// The rest of advance() at surfaces; those of `behind` are hidden by holes.
  [[gnu::always_inline]] void reach_surfaces(Wave& wave, std::size_t first, Vertex& at, unsigned on,
                                             const SegmentLanes<N>& segments,
                                             const RawHit (&hits)[N], unsigned ground,
                                             unsigned behind, int depth, std::uint64_t& rays) const;
  /// Takes the vertex's surfaces, and what their paths bring.
  [[gnu::always_inline]] void load_vertex(const WavePaths& paths, std::size_t first,
                                          const SegmentLanes<N>& segments, Vertex& at) const;
  /// Gives the surfaces in the lanes of `on` the colours of their paths' wavelengths.
  [[gnu::always_inline]] static void color_surfaces(const Wave& wave, std::size_t first,
                                                    unsigned on, Vertex& at);
  bool has_fog() const {
    if constexpr (Options::has_media) {
      return fog_ != nullptr;
    }
    return false;
  }
  /// Of N paths from `first` on.
  Ints<N> null_scatterings(const WaveArray<std::int32_t>& of, std::size_t first) const {
    return scene_.has_clear ? load<N>(of.at + first) : Ints<N>(0);
  }
  /// PathState::bounces() of path i, if shares of the light are recorded.
  int bounces(const WaveArray<std::int32_t>& of, std::size_t i, int depth) const {
    return kHasLedger && scene_.has_clear ? depth - of.at[i] : depth;
  }
  /// The lanes of `on` that may scatter at surfaces.
  unsigned below_max_depth(const WavePaths& paths, std::size_t first, unsigned on,
                           int depth) const {
    Ints<N> scatterings(depth);
    if constexpr (Options::has_media) {
      scatterings = scatterings - load<N>(paths.medium_scatterings.at + first);
    } else if (!scene_.has_clear) {
      return depth < max_depth_ ? on : 0;
    }
    scatterings = scatterings - null_scatterings(paths.null_scatterings, first);
    return on & (scatterings < Ints<N>(max_depth_)).bits();
  }
  template <bool kCatches = false>
  [[gnu::flatten]] void extend(Wave& wave, const Vertex& at, const BsdfLanes<N>& bsdf,
                               const Numbers& numbers, int depth) const;
  Unshadowed unshadowed(const Vertex& at, const BsdfLanes<N>& bsdf, Mask<N> asked, Floats<N> u_pick,
                        Vec2s<N> u) const;
  [[gnu::noinline]] Unshadowed resampled(const Wave& wave, const Vertex& at,
                                         const BsdfLanes<N>& bsdf, Mask<N> asked,
                                         const Numbers& numbers, int depth,
                                         const Vec4s<N>& u) const;
  template <bool kCatches>
  void add_light_samples(Wave& wave, const Vertex& at, const BsdfLanes<N>& bsdf,
                         const Numbers& numbers, int depth, const Vec4s<N>& u) const;
  void fill_shadows(TracedPacket& packet, const Wave& wave, std::size_t first,
                    unsigned active) const;
  template <typename Arrive>
  [[gnu::noinline]] void pass_light(Wave& wave, std::uint64_t& rays, const Arrive& arrive) const;
  [[gnu::noinline]] Vec3 transmittance(const Wave& wave, std::size_t i, int depth,
                                       std::uint64_t& rays) const;
  Vec4s<N> draw(const Wave& wave, const Numbers& numbers, unsigned on, int group,
                Drawn drawn = Drawn::kAll) const;
  PathSampler sampler_of(const Wave& wave, std::int32_t slot) const {
    const PathSampler& whole = wave.samplers[sample_of(slot)];
    const int continuation = continuation_of(slot);
    return continuation == 0 ? whole : whole.branch(continuation - 1, split_count_);
  }
  /// Weight of contributions of a path.
  float share(std::int32_t slot) const { return continuation_of(slot) == 0 ? 1.0F : share_; }
  Floats<N> shares(Ints<N> slot) const {
    return select(slot < Ints<N>(1 << kContinuationShift), Floats<N>(1), Floats<N>(share_));
  }

  const SceneData& scene_;
  const Environment* environment_;
  Backdrop backdrop_;
  int max_depth_;
  int split_count_;  ///< continuations at the first surface
  float share_;      ///< weight of each continuation
  bool is_sobol_;
  std::size_t share_count_;
  bool has_alpha_weights_;
  PathTracer<Options> scalar_;
  [[no_unique_address]] typename Options::Ledger ledger_;
  LaneCatcher<N, Options> catcher_;
  ScalarPaths<Options> scalar_paths_;
  const Fog* fog_;  ///< null if there is none
  LaneLights lights_;
  LaneSurfaces surfaces_;
  bool is_open_;         ///< the shutter: paths have times
  bool moves_;           ///< surfaces move
  bool has_exceptions_;  ///< hits may be holes, or on a catcher
};

}  // namespace
}  // namespace core

// Slices rendered elsewhere from their bytes alone: the film is the same, and results that no
// renderer made are refused.
#include "core/render/units/slice_work.h"

#include <cstring>
#include <functional>
#include <limits>
#include <optional>

#include <gtest/gtest.h>
#include <zlib.h>

#include "core/film/tile_planes.h"
#include "core/integrators/registry.h"
#include "core/render/task/settle.h"
#include "core/render/units/result_size.h"
#include "core/render/units/unit_renderer.h"
#include "core/settings/choices.h"
#include "core/settings/light_shares.h"
#include "tests/support/insane.h"
#include "tests/support/scenes.h"
#include "tests/support/tasks.h"

namespace {

using core::SliceWork;
using core::WorkPart;
using test_support::renderer_of;
using test_support::samples;

core::View small_view() {
  core::View view = test_support::cornell_view(70, 45, 35);
  view.settings.film.albedo = view.settings.film.normal = view.settings.film.depth = true;
  return view;
}

using Film = std::shared_ptr<const core::Film>;

/// Renders the view's film, sending every slice as bytes to another renderer and back.
Film lent_film(
    const core::View& view, int sample_count,
    const std::function<void(SliceWork&)>& spoil = [](SliceWork&) {}) {
  const auto here = renderer_of(view);
  core::UnitRenderer elsewhere(renderer_of(view));
  auto film = core::make_film(view.settings);
  core::NullSink sink;
  core::RenderTask task(here, film, samples(sample_count), sink);
  while (!task.finished()) {
    std::vector<SliceWork> given;
    while (given.size() < 3) {
      const auto slice = task.take(core::RenderTask::Process::kOther);
      if (!slice) {
        break;
      }
      given.push_back(task.prepare(*slice, 1e-4));
    }
    if (given.empty()) {
      if (const auto own = task.can_lend() ? std::nullopt : task.take()) {
        task.run(*own);  // of the reference images, which are not lent
      }
      continue;
    }
    auto sent = core::decode_work(core::encode_work(given, WorkPart::kInput), WorkPart::kInput);
    EXPECT_TRUE(sent);
    EXPECT_TRUE(elsewhere.render(*sent, {}));
    const std::string result = core::encode_work(*sent, WorkPart::kResult);
    EXPECT_LE(result.size(), core::result_bytes_max(*film, given.size()));
    auto done = core::decode_work(result, WorkPart::kResult);
    EXPECT_TRUE(done);
    const auto checked = core::check_result(
        given.size(), [&](std::size_t i) { return given[i]; }, view.settings, *done);
    EXPECT_TRUE(checked) << checked.error().message;
    spoil(done->front());
    task.accept(*std::move(done));
  }
  return film;
}

Film local_film(const core::View& view, int sample_count) {
  auto film = core::make_film(view.settings);
  core::NullSink sink;
  core::RenderTask task(renderer_of(view), film, samples(sample_count), sink);
  core::run_to_end(task, 1);
  return film;
}

std::string digest_of_lent(const core::View& view, int sample_count) {
  return lent_film(view, sample_count)->digest();
}

std::string digest_of_local(const core::View& view, int sample_count) {
  return local_film(view, sample_count)->digest();
}

std::vector<core::MeterSum> meter_sums(const Film& film) {
  std::vector<core::MeterSum> sums;
  for (const core::MeterChunk& chunk : film->meter()) {
    sums.insert(sums.end(), chunk.sums.begin(), chunk.sums.end());
  }
  return sums;
}

TEST(SliceWork, LargestResultIsKnownBeforeRendering) {
  core::View view = small_view();
  view.settings.integrator = "bdpt";
  view.settings.film.albedo = view.settings.film.normal = view.settings.film.depth = false;
  const auto film = core::make_film(view.settings);
  const auto tiles = core::tile_rects({0, 0, 70, 45});
  const core::SplatLayout layout = core::splat_layout(view.settings, tiles);
  // Sums with the maximum number of bits everywhere: 19 bytes each, since ceil(128 / 7) is 19.
  core::SplatTiles sums(tiles.size());
  for (std::size_t t = 0; t < tiles.size(); ++t) {
    const core::SplatSum most = core::SplatSum{1} << 126U;
    sums[t].resize(layout.size(t));
    for (core::SplatPixel& pixel : sums[t]) {
      pixel.sum = {most, -most, most};
    }
  }
  const std::size_t packed = core::pack_sums(layout, sums).size();
  EXPECT_EQ(packed, 70U * 45U * 2U * (1U + 3U * 19U));
  EXPECT_LE(packed, core::result_bytes_max(*film, 0));
  // Every second sum: skipped sums need no more bytes than stored ones.
  for (auto& tile : sums) {
    for (std::size_t i = 0; i < tile.size(); i += 2) {
      tile[i] = core::SplatPixel{};
    }
  }
  EXPECT_LE(core::pack_sums(layout, sums).size(), packed);
}

TEST(SliceWork, MakesTheSameFilmWithEverySampler) {
  for (const auto& sampler : core::samplers()) {
    core::View view = small_view();
    view.settings.sampler = sampler.value;
    EXPECT_EQ(digest_of_lent(view, 6), digest_of_local(view, 6)) << sampler.name;
  }
}

TEST(SliceWork, MakesTheSameFilmWithAnAdaptivePlan) {
  core::View view = small_view();
  view.settings.adaptive.type = core::AdaptiveType::kPilot;
  EXPECT_EQ(digest_of_lent(view, 48), digest_of_local(view, 48));
}

TEST(SliceWork, MakesTheSameFilmWithFittedCoefficientsAndSharedSamples) {
  core::View fitted = small_view();
  fitted.settings.estimator.control_variate = core::ControlVariateType::kRegression;
  EXPECT_EQ(digest_of_lent(fitted, 16), digest_of_local(fitted, 16));
  core::View shared = small_view();
  shared.settings.light_sampler = core::LightSamplerType::kRestir;
  EXPECT_EQ(digest_of_lent(shared, 16), digest_of_local(shared, 16));
}

TEST(SliceWork, MakesTheSameFilmWithEveryRemoteIntegrator) {
  for (const core::IntegratorEntry& row : core::integrators()) {
    if (row.keeps_prepass) {
      continue;
    }
    core::View view = small_view();
    view.settings = core::default_settings(row.name);
    view.settings.film = small_view().settings.film;
    view.settings.film.crop = core::PixelRect{10, 5, 50, 30};
    EXPECT_EQ(digest_of_lent(view, 3), digest_of_local(view, 3)) << row.name;
  }
}

TEST(SliceWork, DoesNotSendAPrepassForAllSamples) {
  core::View view = small_view();
  view.settings = core::default_settings("irradiance-cache");
  view.settings.film = small_view().settings.film;
  view.settings.cache.rays = 16;
  view.settings.cache.tolerance = 1;
  auto film = core::make_film(view.settings);
  core::NullSink sink;
  core::RenderTask task(renderer_of(view), film, samples(2), sink);
  EXPECT_FALSE(task.can_lend());
  EXPECT_FALSE(task.take(core::RenderTask::Process::kOther));
  core::run_to_end(task, 1);
  EXPECT_EQ(task.stop_reason(), core::StopReason::kSamples);
  EXPECT_TRUE(core::RenderTask(renderer_of(small_view()), core::make_film(small_view().settings),
                               samples(2), sink)
                  .can_lend());
}

TEST(SliceWork, MakesTheSameFilmWithAMeter) {
  core::View view = small_view();
  for (int i = 0; i < 20; ++i) {
    const float x = 0.04F * static_cast<float>(i) + 0.1F;
    view.settings.meter.points.push_back({{x, 0.01F, 0.5F}, {0, 1, 0}});
  }
  const auto sums = meter_sums(local_film(view, 3));
  EXPECT_EQ(sums.size(), 20U * core::kMeterReplicates);
  EXPECT_EQ(meter_sums(lent_film(view, 3)), sums);
}

TEST(SliceWork, DetectsAMissingLightPath) {
  core::View view = small_view();
  view.settings.integrator = "light-trace";
  const std::string whole = digest_of_local(view, 3);
  const auto lose = [](SliceWork& done) { done.light.sums.clear(); };
  EXPECT_NE(lent_film(view, 3, lose)->digest(), whole);
}

TEST(SliceWork, IsTakenAgainAfterItIsReturned) {
  const core::View view = small_view();
  auto film = core::make_film(view.settings);
  core::NullSink sink;
  core::RenderTask task(renderer_of(view), film, samples(4), sink);
  for (int i = 0; i < 20; ++i) {
    const auto slice = task.take();
    ASSERT_TRUE(slice);
    task.give_back(*slice);
  }
  core::run_to_end(task, 1);
  EXPECT_EQ(film->digest(), digest_of_local(view, 4));
}

class SliceResult : public ::testing::Test {
 protected:
  explicit SliceResult(core::View view = small_view(), int sample_count = 4,
                       core::SliceKind kind = core::SliceKind::kPicture)
      : view_(std::move(view)),
        film_(core::make_film(view_.settings)),
        task_(renderer_of(view_), film_, samples(sample_count), sink_),
        given_(first_of(kind)),
        done_(given_) {
    EXPECT_TRUE(core::render_slice(task_.renderer(), done_, {}));
    done_.state.plan.clear();
  }
  bool is_taken() {
    SliceWork copy = done_;
    return core::check_result(1, [this](std::size_t) { return given_; }, view_.settings, {&copy, 1})
        .has_value();
  }
  /// Runs the slices before the first one of this kind.
  SliceWork first_of(core::SliceKind kind) {
    auto slice = task_.take();
    for (; slice && slice->kind != kind; slice = task_.take()) {
      task_.run(*slice);
    }
    return task_.prepare(slice.value(), 1);
  }
  /// Spoils the last value of each array of the result in turn. Returns the arrays that had values.
  int spoil_each() {
    int arrays = 0;
    core::for_each_plane([&](const auto& plane) {
      auto& values = done_.state.*plane.values;
      if (!values.empty()) {
        const auto good = values.back();
        test_support::make_insane(values.back());
        EXPECT_FALSE(is_taken()) << "array " << arrays;
        values.back() = good;
        ++arrays;
      }
    });
    return arrays;
  }

  core::View view_;
  std::shared_ptr<core::Film> film_;
  core::NullSink sink_;
  core::RenderTask task_;
  SliceWork given_;
  SliceWork done_;
};

TEST_F(SliceResult, IsAcceptedAsRendered) { EXPECT_TRUE(is_taken()); }

TEST_F(SliceResult, RefusesOtherSamples) {
  ++done_.slice.first_sample;
  EXPECT_FALSE(is_taken());
}

TEST_F(SliceResult, RefusesAnotherTile) {
  done_.slice.tile = 1;
  EXPECT_FALSE(is_taken());
}

TEST_F(SliceResult, RefusesAnotherRectangle) {
  done_.state.rect.x += 32;
  EXPECT_FALSE(is_taken());
}

TEST_F(SliceResult, RefusesNonFiniteValues) {
  done_.state.pixels[3].mean_g = std::numeric_limits<float>::quiet_NaN();
  EXPECT_FALSE(is_taken());
}

TEST_F(SliceResult, RefusesASampleTooMany) {
  ++done_.state.pixels[3].count;
  EXPECT_FALSE(is_taken());
}

TEST_F(SliceResult, RefusesMoreHitsThanSamples) {
  done_.state.aux[3].hits = 5;
  EXPECT_FALSE(is_taken());
}

TEST_F(SliceResult, RefusesFewerPixels) {
  done_.state.pixels.pop_back();
  EXPECT_FALSE(is_taken());
}

TEST_F(SliceResult, RefusesTruncatedOrChangedBytes) {
  const std::string bytes = core::encode_work({&done_, 1}, WorkPart::kResult);
  EXPECT_TRUE(core::decode_work(bytes, WorkPart::kResult));
  std::string changed = bytes;
  changed[200] = static_cast<char>(changed[200] ^ 1);
  EXPECT_FALSE(core::decode_work(changed, WorkPart::kResult));
  // A wrong array length under a valid checksum: the array is truncated.
  for (std::size_t cut : {1U, 64U, 1000U}) {
    std::string shorter = bytes.substr(0, bytes.size() - sizeof(std::uint32_t) - cut);
    const auto sum = static_cast<std::uint32_t>(
        crc32_z(0, reinterpret_cast<const Bytef*>(shorter.data()), shorter.size()));
    shorter.append(reinterpret_cast<const char*>(&sum), sizeof sum);
    EXPECT_FALSE(core::decode_work(shorter, WorkPart::kResult)) << cut;
  }
}

TEST_F(SliceResult, OfATileWithoutSamplesIsSmallAsInputAndRefusedAsResult) {
  const std::string bytes = core::encode_work({&given_, 1}, WorkPart::kInput);
  EXPECT_LT(bytes.size(), 300U);
  const auto input = core::decode_work(bytes, WorkPart::kInput);
  ASSERT_TRUE(input);
  const auto& sent = input->front().state.pixels;
  ASSERT_EQ(sent.size(), given_.state.pixels.size());
  EXPECT_EQ(std::memcmp(sent.data(), given_.state.pixels.data(), sent.size() * sizeof sent[0]), 0);
  EXPECT_EQ(input->front().state.aux.size(), given_.state.aux.size());
  EXPECT_FALSE(core::decode_work(bytes, WorkPart::kResult));
  const std::string later = core::encode_work({&done_, 1}, WorkPart::kInput);
  EXPECT_GT(later.size(), done_.state.pixels.size() * sizeof(core::ReplicatePixel));
}

class FullSliceResult : public SliceResult {
 protected:
  FullSliceResult() : SliceResult(full_view()) {}

 private:
  static core::View full_view() {
    core::View view = small_view();
    core::FilmSettings& film = view.settings.film;
    film.object = film.object_mattes = film.material_mattes = film.z_depth = true;
    film.shares = {*core::light_share("bounce:1")};
    return view;
  }
};

TEST_F(FullSliceResult, IsRefusedWithAnInsaneValueOfAnyArray) {
  EXPECT_TRUE(is_taken());
  EXPECT_EQ(spoil_each(), 6);  // pixels, aux, shares, first hits, mattes, depths
  EXPECT_TRUE(is_taken());
}

TEST_F(FullSliceResult, IsRefusedWithMattesThatNoSamplesHit) {
  done_.state.mattes[3] = {{{1, {0, 0}}}};
  EXPECT_FALSE(is_taken()) << "an id without hits";
  done_.state.mattes[3] = {{{2, {1, 0}}, {1, {1, 0}}}};
  EXPECT_FALSE(is_taken()) << "ids out of order";
  done_.state.mattes[3] = {{{1, {1U << 20U, 0}}}};
  EXPECT_FALSE(is_taken()) << "more hits than samples";
}

class PilotSliceResult : public SliceResult {
 protected:
  PilotSliceResult() : SliceResult(pilot_view(), 48, core::SliceKind::kPilot) {}

 private:
  static core::View pilot_view() {
    core::View view = small_view();
    view.settings.adaptive.type = core::AdaptiveType::kPilot;
    return view;
  }
};

TEST_F(PilotSliceResult, IsRefusedWithAnInsanePilot) {
  EXPECT_TRUE(is_taken());
  EXPECT_EQ(spoil_each(), 3);  // pixels, aux, pilot
}

class FittedSliceResult : public SliceResult {
 protected:
  FittedSliceResult() : SliceResult(fitted_view()) {}

 private:
  static core::View fitted_view() {
    core::View view = small_view();
    view.settings.estimator.control_variate = core::ControlVariateType::kRegression;
    return view;
  }
};

TEST_F(FittedSliceResult, IsRefusedWithAnInsaneFit) {
  EXPECT_TRUE(is_taken());
  EXPECT_EQ(spoil_each(), 3);  // pixels, aux, fit
}

TEST_F(SliceResult, RefusesAPlan) {
  done_.state.plan.resize(done_.state.pixels.size() / 2);
  EXPECT_FALSE(is_taken()) << "results have none";
}

}  // namespace

#include "core/render/units/slice_work.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string_view>
#include <utility>

#include <zlib.h>

#include "core/base/check.h"
#include "core/base/sha256.h"
#include "core/film/sane_pixel.h"
#include "core/film/tile_planes.h"
#include "core/render/task/pass_plan.h"
#include "core/render/units/result_size.h"

namespace core {
namespace {

static_assert(std::endian::native == std::endian::little,
              "values are written as they are in memory");

constexpr std::string_view kMagic = "TSRWORK5";

/// Calls visit(array) for each array of a tile.
template <typename Tile, typename Visit>
void visit_arrays(Tile& tile, const Visit& visit) {
  for_each_plane([&](const auto& plane) { visit(tile.*plane.values); });
}

struct Head {
  std::array<char, 8> magic{};
  std::uint32_t slices = 0;
  std::uint32_t zero = 0;
};
/// Lengths of a tile's arrays, and a zero if their number is odd: padding, with any bytes, would be
/// part of digests.
using Sizes = std::array<std::uint32_t, (kTilePlaneCount + 1) / 2 * 2>;

struct SliceHead {
  std::int32_t tile = 0;
  std::int32_t first_sample = 0;
  std::int32_t last_sample = 0;
  std::int32_t kind = 0;
  PixelRect rect;
  std::int32_t samples = 0;
  PlanSpan span;
  std::int32_t pilot_samples = 0;
  Sizes sizes{};
  std::uint64_t rejected_samples = 0;
  std::uint64_t rays = 0;
  double cpu_seconds = 0;
  std::int32_t light_unit = 0;
  PixelRect unit;
  std::int32_t first_light_sample = 0;
  std::int32_t last_light_sample = 0;
  std::int32_t chunk = 0;
  std::int32_t meter_samples = 0;
  std::uint32_t splat_bytes = 0;
  std::uint32_t meter_sums = 0;
  std::uint32_t is_new = 0;
  std::uint64_t light_rejected_samples = 0;
  std::uint64_t light_rays = 0;
  double light_cpu_seconds = 0;
  std::uint64_t meter_rejected_samples = 0;
  std::uint64_t meter_rays = 0;
  double meter_cpu_seconds = 0;
};
static_assert(sizeof(Head) == 16 && sizeof(PixelRect) == 16 &&
              sizeof(SliceHead) == 168 + sizeof(Sizes));
static_assert(sizeof(MeterSum) == 24);

Error refused(std::string detail) {
  return Error{ErrorCode::kInvalidArgument, "not a valid work unit: " + std::move(detail), ""};
}

std::uint32_t checksum(std::string_view bytes) {
  return static_cast<std::uint32_t>(
      crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

template <typename Value>
void append(std::string& bytes, const Value* values, std::size_t count) {
  bytes.append(reinterpret_cast<const char*>(values), count * sizeof(Value));
}

/// Returns whether the tile has no samples yet: all its arrays have their initial values.
bool is_new(const TileState& s) {
  return s.samples == 0 && s.pilot_samples == 0 && s.plan.empty() && s.pilot.empty() &&
         s.fit.empty();
}

/// Calls visit(array, length) for the tile's arrays. Results leave plans out.
template <typename Visit>
void visit_written(const TileState& s, WorkPart part, Visit&& visit) {
  visit_arrays(s, [&](const auto& values) {
    const bool is_plan = static_cast<const void*>(&values) == &s.plan;
    visit(values, is_plan && part == WorkPart::kResult ? 0 : values.size());
  });
}

/// Returns the lengths of the tile's arrays, in their order.
Sizes array_sizes(const TileState& s, WorkPart part) {
  Sizes sizes{};
  std::size_t i = 0;
  visit_written(s, part, [&](const auto&, std::size_t size) {
    sizes[i++] = static_cast<std::uint32_t>(size);
  });
  return sizes;
}

class Reader {
 public:
  explicit Reader(std::string_view rest) : rest_(rest) {}
  /// Returns false if fewer bytes are left.
  template <typename Value>
  bool take(Value* values, std::size_t count) {
    const std::size_t bytes = count * sizeof(Value);
    if (bytes > rest_.size()) {
      return false;
    }
    if (count > 0) {
      std::memcpy(static_cast<void*>(values), rest_.data(), bytes);
    }
    rest_.remove_prefix(bytes);
    return true;
  }
  template <typename Values>
  bool take(Values& values, std::uint32_t count) {
    if (std::uint64_t{count} * sizeof(typename Values::value_type) > rest_.size()) {
      return false;
    }
    values.resize(count);
    return take(values.data(), values.size());
  }
  bool is_empty() const { return rest_.empty(); }

 private:
  std::string_view rest_;
};

/// Reads the tile's arrays. Returns false if the data ends before their end.
bool take_arrays(Reader& reader, const SliceHead& slice, TileState& s) {
  bool whole = true;
  std::size_t i = 0;
  visit_arrays(s, [&](auto& values) { whole = whole && reader.take(values, slice.sizes[i++]); });
  return whole;
}

/// Returns whether every half of every pixel has the number of samples in the plan, or the uniform
/// one.
bool has_counts(const TileState& state, const RenderSettings& settings) {
  const auto replicates = static_cast<std::size_t>(settings.replicates);
  const int step = plan_step(settings);
  for (std::size_t pixel = 0; pixel * replicates < state.pixels.size(); ++pixel) {
    std::array<std::uint64_t, 2> has{};
    for (std::size_t r = 0; r < replicates; ++r) {
      has[r % 2] += state.pixels[pixel * replicates + r].count;
    }
    const int x = state.rect.x + static_cast<int>(pixel) % state.rect.width;
    const int y = state.rect.y + static_cast<int>(pixel) / state.rect.width;
    for (const int half : {0, 1}) {
      const std::uint64_t want =
          state.plan.empty()
              ? static_cast<std::uint64_t>(uniform_count(state.samples, settings.replicates, half))
              : planned_count(state.plan[pixel], {state.span, step, x, y}, state.samples);
      if (has[static_cast<std::size_t>(half)] != want) {
        return false;
      }
    }
  }
  return true;
}

/// Returns whether the counters of the renderer have not decreased.
template <typename Counted>
bool has_gone_on(const Counted& before, const Counted& after) {
  return std::isfinite(after.cpu_seconds) && after.cpu_seconds >= before.cpu_seconds &&
         after.rays >= before.rays && after.rejected_samples >= before.rejected_samples;
}

Status check_meter(const SliceWork& given, const RenderSettings& settings, const SliceWork& done) {
  const int last = given.chunk < 0 ? given.meter.samples : given.slice.last_sample;
  const std::size_t first = static_cast<std::size_t>(std::max(given.chunk, 0)) * kMeterChunk;
  const std::size_t sums =
      given.chunk < 0
          ? 0
          : std::min<std::size_t>(kMeterChunk, settings.meter.count() - first) * kMeterReplicates;
  const bool are_finite =
      std::all_of(done.meter.sums.begin(), done.meter.sums.end(), [](const MeterSum& sum) {
        return std::all_of(sum.begin(), sum.end(), [](double v) { return std::isfinite(v); });
      });
  return done.chunk == given.chunk && done.meter.samples == last &&
                 done.meter.sums.size() == sums && are_finite &&
                 has_gone_on(given.meter, done.meter)
             ? ok_status()
             : Status(refused("its meter sums do not match the slice"));
}

/// Checks the light paths of one slice; adds the number of paths of its sums to `paths`.
Status check_light(const SliceWork& given, const SliceWork& done, bool is_first,
                   std::uint64_t& paths) {
  const LightBatch& before = given.light;
  const LightBatch& after = done.light;
  if (after.unit != before.unit || !(done.unit == given.unit) ||
      after.first_sample != before.first_sample || after.last_sample != before.last_sample ||
      !has_gone_on(before, after) || (!is_first && !after.sums.empty())) {
    return refused("its light paths are not the requested ones");
  }
  const auto area =
      static_cast<std::uint64_t>(given.unit.width) * static_cast<std::uint64_t>(given.unit.height);
  paths += area * static_cast<std::uint64_t>(before.last_sample - before.first_sample);
  return ok_status();
}

Status check_sums(const RenderSettings& settings, const std::string& sums, std::uint64_t paths) {
  const std::vector<PixelRect> tiles = tile_rects(settings.film.area());
  return are_sums_of(splat_layout(settings, tiles), sums, paths)
             ? ok_status()
             : Status(refused("its splat sums are invalid"));
}

Status check_tile(const SliceWork& given, const RenderSettings& settings, SliceWork& done) {
  const TileState& before = given.state;
  TileState& after = done.state;
  const bool is_pilot = given.slice.kind == SliceKind::kPilot;
  if (done.slice.tile != given.slice.tile || done.slice.kind != given.slice.kind ||
      done.slice.first_sample != given.slice.first_sample ||
      done.slice.last_sample != given.slice.last_sample) {
    return refused("its samples are not the requested ones");
  }
  // Units outside of the crop and chunks of a meter have no pixels.
  const int last = before.pixels.empty() ? before.samples : given.slice.last_sample;
  const std::size_t area = before.pixels.size() / static_cast<std::size_t>(settings.replicates);
  const std::size_t fits =
      is_pilot || fit_type(settings) == FitType::kNone ? before.fit.size() : before.pixels.size();
  const std::size_t pilots = is_pilot ? area : before.pilot.size();
  bool has_lengths = true;
  for_each_plane([&](const auto& plane) {
    const auto& had = before.*plane.values;
    const void* array = &had;
    const std::size_t wanted = array == &before.plan    ? 0
                               : array == &before.pilot ? pilots
                               : array == &before.fit   ? fits
                                                        : had.size();
    has_lengths = has_lengths && (after.*plane.values).size() == wanted;
  });
  if (!has_lengths || !(after.rect == before.rect) || !(after.span == before.span) ||
      after.samples != (is_pilot ? before.samples : std::max(last, before.samples)) ||
      after.pilot_samples != (is_pilot ? last : before.pilot_samples)) {
    return refused("tile " + std::to_string(given.slice.tile) +
                   " does not match the requested slice");
  }
  after.plan = before.plan;
  const bool has_all_pilots =
      std::all_of(after.pilot.begin(), after.pilot.end(), [&](const PilotPixel& p) {
        return p.count == static_cast<std::uint32_t>(after.pilot_samples);
      });
  if (!has_all_pilots || !has_counts(after, settings) ||
      !is_sane(after, static_cast<std::size_t>(settings.replicates)) ||
      !has_gone_on(before, after)) {
    return refused("tile " + std::to_string(given.slice.tile) + " contains invalid values");
  }
  return ok_status();
}

}  // namespace

bool render_slice(const Renderer& renderer, SliceWork& work, std::stop_token stop) {
  const int last = work.slice.last_sample;
  if (work.chunk >= 0) {
    return renderer.render_meter(work.chunk, work.meter, last, std::move(stop));
  }
  if (work.slice.kind == SliceKind::kPilot) {
    return renderer.render_pilot(work.state, last, std::move(stop));
  }
  const bool has_pixels = !work.state.pixels.empty();
  if (has_pixels && !renderer.render(work.state, std::max(last, work.state.samples), stop)) {
    return false;
  }
  return renderer.render_light(work.unit, work.light, std::move(stop));
}

WorkWriter::WorkWriter(WorkPart part, std::size_t slices) : part_(part), left_(slices) {
  Head head;
  std::copy_n(kMagic.begin(), head.magic.size(), head.magic.begin());
  head.slices = static_cast<std::uint32_t>(slices);
  append(bytes_, &head, 1);
}

void WorkWriter::add(const SliceWork& work) {
  CHECK(work.slice.kind == SliceKind::kPicture || work.slice.kind == SliceKind::kPilot);
  const TileState& s = work.state;
  const bool is_left_out = part_ == WorkPart::kInput && is_new(s);
  const auto count = [](std::size_t size) { return static_cast<std::uint32_t>(size); };
  const SliceHead slice = {work.slice.tile,
                           work.slice.first_sample,
                           work.slice.last_sample,
                           static_cast<std::int32_t>(work.slice.kind),
                           s.rect,
                           s.samples,
                           s.span,
                           s.pilot_samples,
                           array_sizes(s, part_),
                           s.rejected_samples,
                           s.rays,
                           s.cpu_seconds,
                           work.light.unit,
                           work.unit,
                           work.light.first_sample,
                           work.light.last_sample,
                           work.chunk,
                           work.meter.samples,
                           count(work.light.sums.size()),
                           count(work.meter.sums.size()),
                           is_left_out ? 1U : 0U,
                           work.light.rejected_samples,
                           work.light.rays,
                           work.light.cpu_seconds,
                           work.meter.rejected_samples,
                           work.meter.rays,
                           work.meter.cpu_seconds};
  if (bytes_.size() == sizeof(Head)) {  // Other slices are as large; only the first has splat sums.
    std::size_t bytes = sizeof slice + work.meter.sums.size() * sizeof(MeterSum);
    visit_written(s, part_, [&](const auto& values, std::size_t size) {
      bytes += is_left_out ? 0 : size * sizeof(values[0]);
    });
    bytes_.reserve(sizeof(Head) + left_ * bytes + work.light.sums.size() + sizeof(std::uint32_t));
  }
  append(bytes_, &slice, 1);
  if (!is_left_out) {
    visit_written(s, part_, [this](const auto& values, std::size_t size) {
      append(bytes_, values.data(), size);
    });
  }
  append(bytes_, work.light.sums.data(), work.light.sums.size());
  append(bytes_, work.meter.sums.data(), work.meter.sums.size());
  --left_;
}

std::string WorkWriter::finish() {
  CHECK(left_ == 0);
  const std::uint32_t sum = checksum(bytes_);
  append(bytes_, &sum, 1);
  return std::move(bytes_);
}

std::string encode_work(std::span<const SliceWork> work, WorkPart part) {
  WorkWriter writer(part, work.size());
  for (const SliceWork& each : work) {
    writer.add(each);
  }
  return writer.finish();
}

Result<std::vector<SliceWork>> decode_work(std::string_view bytes, WorkPart part) {
  Head head;
  if (bytes.size() < sizeof head + sizeof(std::uint32_t) || !bytes.starts_with(kMagic)) {
    return refused("it does not begin with TSRWORK5");
  }
  const std::string_view hashed = bytes.substr(0, bytes.size() - sizeof(std::uint32_t));
  std::uint32_t sum = 0;
  std::memcpy(&sum, bytes.data() + hashed.size(), sizeof sum);
  if (checksum(hashed) != sum) {
    return refused("its checksum does not match");
  }
  Reader reader(hashed);
  reader.take(&head, 1);
  if (head.slices == 0 || head.slices > hashed.size() / sizeof(SliceHead) || head.zero != 0) {
    return refused("it has " + std::to_string(head.slices) + " slices");
  }
  std::vector<SliceWork> work(head.slices);
  for (SliceWork& each : work) {
    SliceHead slice;
    TileState& s = each.state;
    if (!reader.take(&slice, 1) || (slice.is_new == 0 && !take_arrays(reader, slice, s)) ||
        !reader.take(each.light.sums, slice.splat_bytes) ||
        !reader.take(each.meter.sums, slice.meter_sums)) {
      return refused("it is truncated");
    }
    if (slice.is_new != 0) {
      if (part == WorkPart::kResult) {
        return refused("a slice has no pixels");
      }
      std::size_t i = 0;
      visit_arrays(s, [&](auto& values) { values.resize(slice.sizes[i++]); });
    }
    if (slice.kind != static_cast<std::int32_t>(SliceKind::kPicture) &&
        slice.kind != static_cast<std::int32_t>(SliceKind::kPilot)) {
      return refused("a slice is of an unknown kind");
    }
    each.slice = {slice.tile, slice.first_sample, slice.last_sample,
                  static_cast<SliceKind>(slice.kind)};
    s.rect = slice.rect;
    s.samples = slice.samples;
    s.span = slice.span;
    s.pilot_samples = slice.pilot_samples;
    s.rejected_samples = slice.rejected_samples;
    s.rays = slice.rays;
    s.cpu_seconds = slice.cpu_seconds;
    each.unit = slice.unit;
    each.light.unit = slice.light_unit;
    each.light.first_sample = slice.first_light_sample;
    each.light.last_sample = slice.last_light_sample;
    each.light.rejected_samples = slice.light_rejected_samples;
    each.light.rays = slice.light_rays;
    each.light.cpu_seconds = slice.light_cpu_seconds;
    each.chunk = slice.chunk;
    each.meter.samples = slice.meter_samples;
    each.meter.rejected_samples = slice.meter_rejected_samples;
    each.meter.rays = slice.meter_rays;
    each.meter.cpu_seconds = slice.meter_cpu_seconds;
  }
  if (!reader.is_empty()) {
    return refused("it has data after its last slice");
  }
  return work;
}

std::uint64_t result_bytes_max(const Film& film, std::size_t slices) {
  // Bytes of a sum: a skip count, and three numbers of 128 bits, seven of them per byte. A skip
  // count above 127 takes more bytes, but skips more sums than that.
  constexpr std::uint64_t kSumBytes = 1 + 3 * ((128 + 6) / 7);
  const PixelRect crop = film.crop();
  const auto pixels =
      static_cast<std::uint64_t>(crop.width) * static_cast<std::uint64_t>(crop.height);
  const std::uint64_t sums = film.has_splats() ? pixels * (1 + film.shares().size()) *
                                                     static_cast<std::uint64_t>(film.replicates())
                                               : 0;
  const std::uint64_t tile_pixels = std::uint64_t{kTileSize} * kTileSize;
  const std::uint64_t tile_bytes = std::min(pixels, tile_pixels) * (film.bytes() / pixels + 1);
  return sizeof(Head) + sizeof(std::uint32_t) + slices * (sizeof(SliceHead) + tile_bytes) +
         sums * kSumBytes;
}

std::string content_digest(std::vector<SliceWork> done) {
  for (SliceWork& each : done) {
    // Photon rays are counted by the worker that traces them, which may differ.
    each.state.cpu_seconds = each.light.cpu_seconds = each.meter.cpu_seconds = 0;
    each.state.rays = 0;
  }
  const std::string bytes = encode_work(done, WorkPart::kResult);
  return sha256_hex(bytes.data(), bytes.size());
}

Status check_result(std::size_t slices, const std::function<SliceWork(std::size_t)>& given,
                    const RenderSettings& settings, std::span<SliceWork> done) {
  if (done.size() != slices) {
    return refused("it has the wrong number of slices");
  }
  std::uint64_t paths = 0;
  for (std::size_t i = 0; i < slices; ++i) {
    const SliceWork before = given(i);
    Status checked = check_light(before, done[i], i == 0, paths);
    checked = checked ? check_tile(before, settings, done[i]) : checked;
    checked = checked ? check_meter(before, settings, done[i]) : checked;
    if (!checked) {
      return checked;
    }
  }
  return check_sums(settings, done.front().light.sums, paths);
}

}  // namespace core

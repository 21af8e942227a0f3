#include "core/film/film_format.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <utility>

#include "core/base/sha256.h"
#include "core/film/sane_pixel.h"
#include "core/film/tile_planes.h"

namespace core {
namespace {

static_assert(std::endian::native == std::endian::little,
              "values are written as they are in memory");

constexpr std::array<char, 8> kMagic = {'T', 'S', 'R', 'F', 'I', 'L', 'M', '1'};
constexpr std::uint64_t kHashBytes = 64;
/// Limit per range: the sum over the maximum number of ranges fits in an int.
constexpr std::uint32_t kSamplesMax = 1U << 25U;
constexpr std::uint32_t kCorrelatedFlag = 2;
constexpr std::uint32_t kSplatsFlag = 4;
constexpr std::uint32_t kOverWhiteFlag = 64;
constexpr std::uint32_t kSharesShift = 8;
/// Limit per replicate: 65,536 samples of 64 megapixels.
constexpr std::uint64_t kLightPathsMax = std::uint64_t{1} << 42U;

struct Head {
  std::array<char, 8> magic = kMagic;
  std::uint32_t head_bytes = 0;
  std::uint32_t text_bytes = 0;
  std::uint32_t ranges = 0;
  std::uint32_t flags = 0;
  std::int32_t full_width = 0;
  std::int32_t full_height = 0;
  PixelRect crop;
  std::uint32_t replicates = 0;
  std::uint32_t tiles = 0;
  std::uint64_t file_bytes = 0;
  std::array<char, kHashBytes> digest{};
};
static_assert(sizeof(Head) == kFilmHeadBytes && sizeof(PixelRect) == 16);

struct Range {
  std::uint64_t seed = 0;
  std::uint32_t first_replicate = 0;
  std::uint32_t replicates = 0;
  std::uint32_t samples = 0;
  std::uint32_t zero = 0;
};
static_assert(sizeof(Range) == 24);

struct TileHead {
  std::int32_t x = 0;
  std::int32_t y = 0;
  std::uint32_t samples = 0;
  std::uint32_t zero = 0;
  std::uint64_t rejected_samples = 0;
  std::uint64_t rays = 0;
  double cpu_seconds = 0;
};
static_assert(sizeof(TileHead) == 40);

std::uint64_t aligned(std::uint64_t bytes) { return (bytes + 7) / 8 * 8; }

std::uint64_t head_bytes(std::uint64_t ranges, std::uint64_t text_bytes) {
  return sizeof(Head) + ranges * sizeof(Range) + aligned(text_bytes);
}

std::uint64_t shares_of(const Head& head) { return head.flags >> kSharesShift; }

/// Returns the bytes of light paths per replicate, rejected splats and rays.
std::uint64_t splat_head_bytes(const Head& head) {
  return (head.flags & kSplatsFlag) != 0 ? (head.replicates + 2) * sizeof(std::uint64_t) : 0;
}

std::uint64_t tile_count(const PixelRect& crop) {
  const auto along = [](int first, int length) {
    return static_cast<std::uint64_t>((first + length - 1) / kTileSize - first / kTileSize + 1);
  };
  return along(crop.x, crop.width) * along(crop.y, crop.height);
}

/// Pre: the crop is valid.
std::uint64_t all_bytes(const Head& head) {
  const std::uint64_t pixels =
      static_cast<std::uint64_t>(head.crop.width) * static_cast<std::uint64_t>(head.crop.height);
  const auto has = [&head](std::uint32_t flag) { return (head.flags & flag) != 0; };
  const TileShape shape = {.replicates = head.replicates,
                           .shares = shares_of(head),
                           .recorded = parts_in(head.flags, &RecordedPart::file_flag)};
  const std::uint64_t splat_bytes =
      has(kSplatsFlag) ? head.replicates * (1 + shares_of(head)) * sizeof(SplatPixel) : 0;
  const auto of_value = [](const auto& plane) { return value_bytes(plane); };
  return head.head_bytes + splat_head_bytes(head) + tile_count(head.crop) * sizeof(TileHead) +
         pixels * (pixel_bytes(shape, of_value) + splat_bytes) + kHashBytes;
}

Head head_of(const Film& film, std::size_t ranges, std::size_t text_bytes) {
  Head head;
  head.head_bytes = static_cast<std::uint32_t>(head_bytes(ranges, text_bytes));
  head.text_bytes = static_cast<std::uint32_t>(text_bytes);
  head.ranges = static_cast<std::uint32_t>(ranges);
  head.flags = flags_of(film.recorded(), &RecordedPart::file_flag) |
               (film.errors() == PixelErrors::kCorrelated ? kCorrelatedFlag : 0) |
               (film.has_splats() ? kSplatsFlag : 0) |
               (film.errors_over_white() ? kOverWhiteFlag : 0) |
               (static_cast<std::uint32_t>(film.shares().size()) << kSharesShift);
  head.full_width = film.full_width();
  head.full_height = film.full_height();
  head.crop = film.crop();
  head.replicates = static_cast<std::uint32_t>(film.replicates());
  head.tiles = static_cast<std::uint32_t>(film.tile_count());
  head.file_bytes = all_bytes(head);
  return head;
}

Error refused(std::string message) {
  return Error{ErrorCode::kInvalidArgument, "not a usable film: " + std::move(message), ""};
}

/// Reads consecutive values, whose presence was checked before.
class Reader {
 public:
  explicit Reader(std::span<const std::byte> rest) : rest_(rest) {}
  template <typename Value>
  void take(Value* values, std::size_t count) {
    if (count > 0) {  // an empty vector may have a null address
      std::memcpy(static_cast<void*>(values), rest_.data(), count * sizeof(Value));
    }
    rest_ = rest_.subspan(count * sizeof(Value));
  }
  template <typename Value>
  Value take() {
    Value value;
    take(&value, 1);
    return value;
  }

 private:
  std::span<const std::byte> rest_;
};

Status check_geometry(const Head& head, const FilmFormatLimits& limits) {
  const PixelRect& crop = head.crop;
  const auto is_side = [&](std::int32_t side) { return side >= 1 && side <= limits.side_max; };
  if (!is_side(head.full_width) || !is_side(head.full_height) ||
      std::int64_t{head.full_width} * head.full_height > limits.pixels_max) {
    return Error{ErrorCode::kTooLarge,
                 "a film of " + std::to_string(head.full_width) + " by " +
                     std::to_string(head.full_height) + " pixels; a side must have 1 to " +
                     std::to_string(limits.side_max) + ", the whole film at most " +
                     std::to_string(limits.pixels_max),
                 ""};
  }
  if (!is_side(crop.width) || !is_side(crop.height) || crop.x < 0 || crop.y < 0 ||
      crop.x > head.full_width - crop.width || crop.y > head.full_height - crop.height) {
    return refused("its crop extends beyond the film");
  }
  if (head.replicates < 2 || head.replicates % 2 != 0 ||
      head.replicates > static_cast<std::uint32_t>(limits.replicates_max)) {
    return refused(std::to_string(head.replicates) + " replicates; an even number up to " +
                   std::to_string(limits.replicates_max) + " is allowed");
  }
  return ok_status();
}

Result<SampleLedger> read_ledger(Reader& reader, const Head& head) {
  SampleLedger ledger;
  std::uint64_t replicates = 0;
  for (std::uint32_t i = 0; i < head.ranges; ++i) {
    const auto range = reader.take<Range>();
    if (range.seed >= (std::uint64_t{1} << 53U) || range.first_replicate % 2 != 0 ||
        range.replicates % 2 != 0 || range.replicates == 0 || range.replicates > head.replicates ||
        range.first_replicate > (1U << 20U) || range.samples > kSamplesMax || range.zero != 0) {
      return refused("range " + std::to_string(i) + " of its samples is invalid");
    }
    for (const SampleRange& other : ledger) {
      const auto first = static_cast<int>(range.first_replicate);
      if (other.seed == range.seed && first < other.first_replicate + other.replicates &&
          other.first_replicate < first + static_cast<int>(range.replicates)) {
        return refused("range " + std::to_string(i) + " of its samples overlaps another");
      }
    }
    replicates += range.replicates;
    ledger.push_back({range.seed, static_cast<int>(range.first_replicate),
                      static_cast<int>(range.replicates), static_cast<int>(range.samples)});
  }
  if (replicates != head.replicates) {
    return refused("its ranges of samples do not add up to its replicates");
  }
  return ledger;
}

/// Raises `most`, of each range, to the samples that a pixel of the tile has in it.
void count_samples(const TileState& state, const SampleLedger& ledger,
                   std::vector<std::uint64_t>& most) {
  for (std::size_t at = 0; at < state.pixels.size();) {
    for (std::size_t r = 0; r < ledger.size(); ++r) {
      std::uint64_t count = 0;
      for (int k = 0; k < ledger[r].replicates; ++k, ++at) {
        count += state.pixels[at].count;
      }
      most[r] = std::max(most[r], count);
    }
  }
}

bool is_sane(const std::vector<SplatPixel>& tile) {
  constexpr SplatSum kMost = SplatSum{1} << 126U;
  return std::all_of(tile.begin(), tile.end(), [](const SplatPixel& p) {
    return std::all_of(p.sum.begin(), p.sum.end(),
                       [](SplatSum sum) { return sum > -kMost && sum < kMost; });
  });
}

Status read_tiles(Reader& reader, Film& film, const SampleLedger& ledger) {
  SplatState splats = film.splats();
  if (film.has_splats()) {
    reader.take(splats.light_paths.data(), splats.light_paths.size());
    reader.take(&splats.rejected_samples, 1);
    reader.take(&splats.rays, 1);
    if (*std::max_element(splats.light_paths.begin(), splats.light_paths.end()) > kLightPathsMax) {
      return refused("it has more light paths than a film can have");
    }
  }
  std::vector<std::uint64_t> most(ledger.size());
  for (int tile = 0; tile < film.tile_count(); ++tile) {
    const auto head = reader.take<TileHead>();
    TileState state = film.tile(tile);
    const auto take = [&](auto& values) { reader.take(values.data(), values.size()); };
    visit_kept_arrays(state, false, take);
    if (film.has_splats()) {
      auto& sums = splats.tiles[static_cast<std::size_t>(tile)];
      reader.take(sums.data(), sums.size());
      if (!is_sane(sums)) {
        return refused("tile " + std::to_string(tile) + " contains invalid values");
      }
    }
    visit_kept_arrays(state, true, take);
    state.samples = static_cast<int>(std::min(head.samples, kSamplesMax));
    state.rejected_samples = head.rejected_samples;
    state.rays = head.rays;
    state.cpu_seconds = head.cpu_seconds;
    if (head.x != state.rect.x || head.y != state.rect.y || head.zero != 0 ||
        !std::isfinite(head.cpu_seconds) || head.cpu_seconds < 0 || head.samples > kSamplesMax ||
        !is_sane(state, static_cast<std::size_t>(film.replicates()))) {
      return refused("tile " + std::to_string(tile) + " contains invalid values");
    }
    count_samples(state, ledger, most);
    if (state.samples > 0) {
      film.commit(tile, std::move(state));
    }
  }
  if (film.has_splats()) {
    film.restore_splats(std::move(splats));
  }
  for (std::size_t r = 0; r < ledger.size(); ++r) {
    if (most[r] != static_cast<std::uint64_t>(ledger[r].samples)) {
      return refused("its pixels have " + std::to_string(most[r]) +
                     " samples, but its ledger says " + std::to_string(ledger[r].samples));
    }
  }
  return ok_status();
}

}  // namespace

std::uint64_t film_file_bytes(const Film& film, const SampleLedger& ledger,
                              std::size_t text_bytes) {
  return head_of(film, ledger.size(), text_bytes).file_bytes;
}

bool write_film(const FilmPart& part, const std::string& text, const ByteSink& sink) {
  const Film& film = *part.film;
  Sha256 hash;
  std::vector<std::byte> piece;
  const auto add = [&piece](const void* values, std::size_t bytes) {
    const auto* from = static_cast<const std::byte*>(values);
    piece.insert(piece.end(), from, from + bytes);
  };
  const auto flush = [&] {
    hash.add(piece.data(), piece.size());
    const bool taken = sink(piece);
    piece.clear();
    return taken;
  };
  Head head = head_of(film, part.ledger.size(), text.size());
  const std::string digest = film.digest();
  std::copy_n(digest.begin(), head.digest.size(), head.digest.begin());
  add(&head, sizeof head);
  for (const SampleRange& range : part.ledger) {
    const Range written = {range.seed, static_cast<std::uint32_t>(range.first_replicate),
                           static_cast<std::uint32_t>(range.replicates),
                           static_cast<std::uint32_t>(range.samples), 0};
    add(&written, sizeof written);
  }
  add(text.data(), text.size());
  piece.resize(head.head_bytes);
  const SplatState splats = film.splats();
  if (film.has_splats()) {
    add(splats.light_paths.data(), splats.light_paths.size() * sizeof(std::uint64_t));
    add(&splats.rejected_samples, sizeof splats.rejected_samples);
    add(&splats.rays, sizeof splats.rays);
  }
  if (!flush()) {
    return false;
  }
  const double beside = film.cpu_seconds_beside() / film.tile_count();
  for (int tile = 0; tile < film.tile_count(); ++tile) {
    const TileState state = film.tile(tile);
    const TileHead written = {state.rect.x,
                              state.rect.y,
                              static_cast<std::uint32_t>(state.samples),
                              0,
                              state.rejected_samples,
                              state.rays,
                              state.cpu_seconds + beside};
    add(&written, sizeof written);
    const auto add_array = [&](const auto& values) {
      add(values.data(), std::span(values).size_bytes());
    };
    visit_kept_arrays(state, false, add_array);
    if (film.has_splats()) {
      const auto& sums = splats.tiles[static_cast<std::size_t>(tile)];
      add(sums.data(), sums.size() * sizeof(SplatPixel));
    }
    visit_kept_arrays(state, true, add_array);
    if (!flush()) {
      return false;
    }
  }
  const std::string whole = hash.hex();
  return sink(std::as_bytes(std::span(whole)));
}

Status check_film_head(std::span<const std::byte> start, std::uint64_t file_bytes,
                       const FilmFormatLimits& limits) {
  Head head;
  if (start.size() < sizeof head) {
    return refused("it is shorter than its header");
  }
  std::memcpy(&head, start.data(), sizeof head);
  if (head.magic != kMagic) {
    return refused("it does not begin with TSRFILM1");
  }
  if (auto fits = check_geometry(head, limits); !fits) {
    return fits;
  }
  // Ranges hold at least two replicates, so these products stay small.
  if (head.ranges == 0 || head.ranges > head.replicates / 2 ||
      head.text_bytes > limits.text_bytes_max ||
      shares_of(head) > static_cast<std::uint64_t>(limits.shares_max) ||
      head.head_bytes != head_bytes(head.ranges, head.text_bytes) ||
      head.tiles != tile_count(head.crop)) {
    return refused("its header is inconsistent");
  }
  const std::uint64_t expected = all_bytes(head);
  if (expected > limits.file_bytes_max) {
    return Error{ErrorCode::kTooLarge,
                 "a film of " + std::to_string(expected) + " bytes; " +
                     std::to_string(limits.file_bytes_max) + " are allowed",
                 ""};
  }
  if (head.file_bytes != expected || file_bytes != expected) {
    return refused("it has " + std::to_string(file_bytes) + " bytes, but its header requires " +
                   std::to_string(expected));
  }
  return ok_status();
}

Result<FilmFileContent> read_film(std::span<const std::byte> file, const FilmFormatLimits& limits,
                                  const SharesOfText& shares) {
  if (const auto fits = check_film_head(file, file.size(), limits); !fits) {
    return fits.error();
  }
  const auto hashed = file.first(file.size() - kHashBytes);
  const std::string whole = sha256_hex(hashed.data(), hashed.size());
  if (std::memcmp(whole.data(), file.data() + hashed.size(), kHashBytes) != 0) {
    return refused("its checksum does not match");
  }
  Reader reader(hashed);
  const auto head = reader.take<Head>();
  auto ledger = read_ledger(reader, head);
  if (!ledger) {
    return ledger.error();
  }
  FilmFileContent content;
  content.text.resize(head.text_bytes);
  reader.take(content.text.data(), content.text.size());
  for (std::uint64_t i = head.text_bytes; i < aligned(head.text_bytes); ++i) {
    if (reader.take<std::byte>() != std::byte{0}) {
      return refused("its text is longer than its header says");
    }
  }
  FilmSettings settings;
  settings.width = head.full_width;
  settings.height = head.full_height;
  settings.crop = head.crop;
  ask_for(parts_in(head.flags, &RecordedPart::file_flag), settings);
  settings.errors_over_white = (head.flags & kOverWhiteFlag) != 0;
  if (shares != nullptr) {
    settings.shares = shares(content.text);
  }
  if (shares != nullptr && settings.shares.size() != shares_of(head)) {
    return refused("the layers in its text do not match its header");
  }
  settings.shares.resize(shares_of(head));
  auto film = std::make_shared<Film>(
      settings, static_cast<int>(head.replicates),
      (head.flags & kCorrelatedFlag) != 0 ? PixelErrors::kCorrelated : PixelErrors::kIndependent,
      (head.flags & kSplatsFlag) != 0);
  if (const auto read = read_tiles(reader, *film, *ledger); !read) {
    return read.error();
  }
  if (film->digest() != std::string_view(head.digest.data(), head.digest.size())) {
    return refused("its content does not match its digest");
  }
  content.part = {std::move(film), std::move(*ledger)};
  return content;
}

}  // namespace core

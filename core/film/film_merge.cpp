#include "core/film/film_merge.h"

#include <algorithm>
#include <numeric>
#include <string>
#include <utility>

#include "core/film/tile_planes.h"

namespace core {
namespace {

/// A range and the position of its replicates.
struct Piece {
  SampleRange range;
  std::size_t part = 0;
  int offset = 0;  ///< index of its first replicate in the part's film
};

Error at_film(ErrorCode code, std::size_t part, std::string message) {
  return Error{code, std::move(message), "/films/" + std::to_string(part)};
}

bool goes_before(const Piece& a, const Piece& b) {
  return a.range.seed != b.range.seed ? a.range.seed < b.range.seed
                                      : a.range.first_replicate < b.range.first_replicate;
}

/// Returns the maximum samples of a pixel in `replicates` replicates from `offset` on.
int most_samples(const Film& film, int offset, int replicates) {
  std::uint32_t most = 0;
  const auto stride = static_cast<std::size_t>(film.replicates());
  for (int tile = 0; tile < film.tile_count(); ++tile) {
    const TileState state = film.tile(tile);
    for (std::size_t i = static_cast<std::size_t>(offset); i < state.pixels.size(); i += stride) {
      std::uint32_t count = 0;
      for (std::size_t k = 0; k < static_cast<std::size_t>(replicates); ++k) {
        count += state.pixels[i + k].count;
      }
      most = std::max(most, count);
    }
  }
  return static_cast<int>(most);
}

Result<std::vector<Piece>> sorted_pieces(std::span<const FilmPart> parts, int replicates_max) {
  std::vector<Piece> pieces;
  int replicates = 0;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const Film& film = *parts[i].film;
    const Film& first = *parts[0].film;
    if (film.full_width() != first.full_width() || film.full_height() != first.full_height() ||
        film.crop() != first.crop()) {
      return at_film(ErrorCode::kInvalidArgument, i,
                     "the film differs from the first one in size or crop");
    }
    if (film.recorded() != first.recorded() || film.has_splats() != first.has_splats() ||
        film.shares().size() != first.shares().size()) {
      return at_film(ErrorCode::kInvalidArgument, i,
                     "the film differs from the first one in its layers");
    }
    int offset = 0;
    for (const SampleRange& range : parts[i].ledger) {
      pieces.push_back({range, i, offset});
      offset += range.replicates;
    }
    CHECK(offset == film.replicates());
    replicates += offset;
  }
  if (replicates > replicates_max) {
    return at_film(ErrorCode::kInvalidArgument, parts.size() - 1,
                   "the films have " + std::to_string(replicates) +
                       " replicates in total; at most " + std::to_string(replicates_max) +
                       " are allowed in one film");
  }
  std::sort(pieces.begin(), pieces.end(), goes_before);
  for (std::size_t i = 1; i < pieces.size(); ++i) {
    const SampleRange& a = pieces[i - 1].range;
    const SampleRange& b = pieces[i].range;
    if (a.seed == b.seed && b.first_replicate < a.first_replicate + a.replicates) {
      const std::size_t earlier = std::min(pieces[i - 1].part, pieces[i].part);
      return at_film(ErrorCode::kConflict, std::max(pieces[i - 1].part, pieces[i].part),
                     "the film shares samples with film " + std::to_string(earlier) +
                         ": replicate " + std::to_string(b.first_replicate) + " of seed " +
                         std::to_string(b.seed));
    }
  }
  return pieces;
}

SampleLedger joined(const std::vector<Piece>& pieces) {
  SampleLedger ledger;
  for (const Piece& piece : pieces) {
    const SampleRange& next = piece.range;
    if (!ledger.empty()) {
      SampleRange& last = ledger.back();
      const bool follows =
          last.seed == next.seed && last.first_replicate + last.replicates == next.first_replicate;
      if (follows && std::int64_t{last.samples} * next.replicates ==
                         std::int64_t{next.samples} * last.replicates) {
        last.replicates += next.replicates;
        last.samples += next.samples;
        continue;
      }
    }
    ledger.push_back(next);
  }
  return ledger;
}

/// Merges values that are not of one replicate. In general all parts have the same, and those of
/// the first are taken.
template <typename Value>
void add_values(std::vector<Value>& sums, const std::vector<Value>& more, bool is_first) {
  if (is_first) {
    sums = more;
  }
}

/// Averages means weighted by hits, in double.
void add_values(std::vector<AuxPixel>& sums, const std::vector<AuxPixel>& more, bool /*is_first*/) {
  for (std::size_t i = 0; i < sums.size(); ++i) {
    AuxPixel& to = sums[i];
    const AuxPixel& from = more[i];
    if (from.hits == 0) {
      continue;
    }
    const double all = static_cast<double>(to.hits) + static_cast<double>(from.hits);
    const double share = static_cast<double>(from.hits) / all;
    const auto mix = [share](float a, float b) {
      return static_cast<float>(static_cast<double>(a) +
                                (static_cast<double>(b) - static_cast<double>(a)) * share);
    };
    to.albedo = {mix(to.albedo.r, from.albedo.r), mix(to.albedo.g, from.albedo.g),
                 mix(to.albedo.b, from.albedo.b)};
    to.normal_world = {mix(to.normal_world.x, from.normal_world.x),
                       mix(to.normal_world.y, from.normal_world.y),
                       mix(to.normal_world.z, from.normal_world.z)};
    to.depth_m = mix(to.depth_m, from.depth_m);
    to.hits += from.hits;
  }
}

void add_values(std::vector<MattePixel>& sums, const std::vector<MattePixel>& more,
                bool /*is_first*/) {
  for (std::size_t i = 0; i < sums.size(); ++i) {
    for (const MatteRank& rank : more[i]) {
      if (rank.id != 0) {
        add_matte(sums[i], rank);
      }
    }
  }
}

std::ptrdiff_t distance(std::size_t values) { return static_cast<std::ptrdiff_t>(values); }

/// Merges a tile of all parts; samples is 0 if none of them has any.
TileState merged_tile(std::span<const FilmPart> parts, const std::vector<Piece>& pieces,
                      const Film& out, int tile) {
  std::vector<TileState> from;
  from.reserve(parts.size());
  for (const FilmPart& part : parts) {
    from.push_back(part.film->tile(tile));
  }
  TileState state = out.tile(tile);
  const auto stride = static_cast<std::size_t>(out.replicates());
  const TileShape shape = shape_of(out);
  std::size_t at = 0;
  std::vector<bool> seen(parts.size());
  for (const Piece& piece : pieces) {
    const TileState& source = from[piece.part];
    const auto source_stride = static_cast<std::size_t>(parts[piece.part].film->replicates());
    const auto offset = static_cast<std::size_t>(piece.offset);
    const auto count = static_cast<std::size_t>(piece.range.replicates);
    for_each_kept_plane([&](const auto& plane) {
      const auto& values = source.*plane.values;
      auto& merged = state.*plane.values;
      if (!plane.is_by_replicate) {
        if (!seen[piece.part]) {
          add_values(merged, values, state.samples == 0);
        }
        return;
      }
      const std::size_t each = plane.per_pixel(shape) / stride;
      for (std::size_t pixel = 0; pixel * stride * each < merged.size(); ++pixel) {
        std::copy_n(values.begin() + distance((pixel * source_stride + offset) * each),
                    count * each, merged.begin() + distance((pixel * stride + at) * each));
      }
    });
    at += count;
    if (!seen[piece.part]) {
      seen[piece.part] = true;
      state.samples += source.samples;
      state.rejected_samples += source.rejected_samples;
      state.rays += source.rays;
      state.cpu_seconds += source.cpu_seconds;
    }
  }
  return state;
}

/// Puts the replicates side by side, as in the tiles.
SplatState merged_splats(std::span<const FilmPart> parts, const std::vector<Piece>& pieces,
                         const Film& out) {
  std::vector<SplatState> from;
  SplatState merged = out.splats();
  for (const FilmPart& part : parts) {
    from.push_back(part.film->splats());
    merged.rejected_samples += from.back().rejected_samples;
    merged.rays += from.back().rays;
  }
  const auto stride = static_cast<std::size_t>(out.replicates());
  std::size_t at = 0;
  for (const Piece& piece : pieces) {
    const SplatState& source = from[piece.part];
    const auto offset = static_cast<std::size_t>(piece.offset);
    const auto count = static_cast<std::size_t>(piece.range.replicates);
    const std::size_t source_stride = source.light_paths.size();
    std::copy_n(&source.light_paths[offset], count, &merged.light_paths[at]);
    for (std::size_t t = 0; t < merged.tiles.size(); ++t) {
      for (std::size_t pixel = 0; pixel * stride < merged.tiles[t].size(); ++pixel) {
        std::copy_n(&source.tiles[t][pixel * source_stride + offset], count,
                    &merged.tiles[t][pixel * stride + at]);
      }
    }
    at += count;
  }
  return merged;
}

}  // namespace

SampleLedger ledger_of(const Film& film, std::uint64_t seed, int first_replicate) {
  return {SampleRange{.seed = seed,
                      .first_replicate = first_replicate,
                      .replicates = film.replicates(),
                      .samples = most_samples(film, 0, film.replicates())}};
}

Result<FilmPart> merge_films(std::span<const FilmPart> parts, int replicates_max) {
  CHECK(!parts.empty());
  const auto pieces = sorted_pieces(parts, replicates_max);
  if (!pieces) {
    return pieces.error();
  }
  const Film& first = *parts[0].film;
  FilmSettings settings;
  settings.width = first.full_width();
  settings.height = first.full_height();
  settings.crop = first.crop();
  ask_for(first.recorded(), settings);
  settings.shares = first.shares();
  settings.errors_over_white = first.errors_over_white();
  const int replicates =
      std::accumulate(pieces->begin(), pieces->end(), 0,
                      [](int sum, const Piece& piece) { return sum + piece.range.replicates; });
  const bool is_correlated = std::any_of(parts.begin(), parts.end(), [](const FilmPart& part) {
    return part.film->errors() == PixelErrors::kCorrelated;
  });
  auto film = std::make_shared<Film>(
      settings, replicates, is_correlated ? PixelErrors::kCorrelated : PixelErrors::kIndependent,
      first.has_splats());
  for (int tile = 0; tile < film->tile_count(); ++tile) {
    TileState state = merged_tile(parts, *pieces, *film, tile);
    if (state.samples > 0) {
      film->commit(tile, std::move(state));
    }
  }
  if (film->has_splats()) {
    film->restore_splats(merged_splats(parts, *pieces, *film));
  }
  for (const FilmPart& part : parts) {
    film->add_cpu_seconds(part.film->cpu_seconds_beside());
  }
  return FilmPart{.film = std::move(film), .ledger = joined(*pieces)};
}

}  // namespace core

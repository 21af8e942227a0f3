/// Films that become one film: of one job made in parts, or of jobs with different seeds.
///
/// The replicates of a film are independent randomisations, and replicate k of a seed holds the
/// same numbers in every job that has it. So films are merged by putting their replicates side by
/// side, which copies and computes nothing: parts that hold replicates 0 to 1 and 2 to 3 of a seed
/// give the film of the one job that has four, bit for bit. The picture weighs replicates by their
/// counts, never by what was found. Means of the auxiliary layers are over all samples together;
/// they are combined by their counts of hits, and agree with those of one job to rounding. Labels
/// are those of any of them; counts of mattes are added.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/base/result.h"
#include "core/film/film.h"

namespace core {

/// Which random numbers the samples of consecutive replicates of a film are from. Every replicate
/// holds its samples from the first one on, so that two ranges have samples in common when they
/// have a replicate in common.
struct SampleRange {
  std::uint64_t seed = 0;
  int first_replicate = 0;  ///< of the seed; even
  int replicates = 2;       ///< even
  int samples = 0;          ///< of the pixel that has most, all replicates of the range together
  friend bool operator==(const SampleRange&, const SampleRange&) = default;
};

/// Where all replicates of a film are from, in the film's order.
using SampleLedger = std::vector<SampleRange>;

/// Of a film that one job made.
SampleLedger ledger_of(const Film& film, std::uint64_t seed, int first_replicate);

struct FilmPart {
  std::shared_ptr<const Film> film;
  SampleLedger ledger;
};

/// The result does not depend on the order of the parts: replicates are sorted by seed and number,
/// and neighbours with equal counts become one range. replicates_max: of the result. Errors:
/// kConflict for common samples, kInvalidArgument for another size or other layers, for too many
/// replicates; `where` is "/films/N".
Result<FilmPart> merge_films(std::span<const FilmPart> parts, int replicates_max);

}  // namespace core

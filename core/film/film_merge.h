/// Merges films: parts of one job, or films of jobs with different seeds.
///
/// The replicates of a film are independent randomisations, and replicate k of a seed uses the same
/// random numbers in every job. Films are therefore merged by putting their replicates side by side
/// without any arithmetic: parts with replicates 0 to 1 and 2 to 3 of a seed give, bit for bit, the
/// film of a job with all four. The image weights replicates by their counts, never by their
/// values. Auxiliary means cover all samples together; they are combined by hit counts and agree
/// with those of one job up to rounding. First hits are taken from any part; counts of mattes are
/// added.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/base/result.h"
#include "core/film/film.h"

namespace core {

/// The random numbers behind consecutive replicates of a film. Every replicate holds its samples
/// from the first one on, so two ranges share samples if and only if they share a replicate.
struct SampleRange {
  std::uint64_t seed = 0;
  int first_replicate = 0;  ///< index within the seed; even
  int replicates = 2;       ///< even
  int samples = 0;  ///< of the pixel with most samples, summed over the replicates of the range
  friend bool operator==(const SampleRange&, const SampleRange&) = default;
};

/// The ranges of all replicates of a film, in the film's order.
using SampleLedger = std::vector<SampleRange>;

/// Returns the ledger of a film that one job made.
SampleLedger ledger_of(const Film& film, std::uint64_t seed, int first_replicate);

struct FilmPart {
  std::shared_ptr<const Film> film;
  SampleLedger ledger;
};

/// Merges films. The result does not depend on the order of the parts: replicates are sorted by
/// seed and index, and neighbouring ranges with equal counts are joined. replicates_max limits the
/// result. Errors: kConflict if parts share samples; kInvalidArgument for different sizes or
/// layers, or for too many replicates; `where` is "/films/N".
Result<FilmPart> merge_films(std::span<const FilmPart> parts, int replicates_max);

}  // namespace core

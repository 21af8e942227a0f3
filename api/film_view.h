/// What is said about a film beside its numbers: the text in a film file, and which films fit
/// together.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "api/job_spec.h"
#include "api/job_view.h"
#include "api/problem.h"
#include "core/film/film_merge.h"

namespace api {

/// JSON: version, job, spec, state, stop_reason, samples_by_error (0: no error chose their number),
/// finished_at, elapsed_seconds, error, warnings, samples (the ledger), build, film_digest.
std::string film_text(const JobView& job, const core::SampleLedger& ledger,
                      std::string_view film_digest);

/// What a merge needs of it.
struct FilmOrigin {
  JobSpec spec;
  core::StopReason stop_reason = core::StopReason::kNone;
  bool is_ended_by_error =
      false;  ///< an error chose its sample count, now or before a clock let it go on
  double elapsed_seconds = 0;
  std::string build;  ///< JSON text; empty: unknown
};
/// Problems: 422 when it is not what film_text() makes; pointers are into the text.
Parsed<FilmOrigin> parse_film_text(std::string_view text);

/// Pointers into the job request where `other` asks for another picture than `first` in
/// expectation, size or layers: films of such jobs do not add up. Name, labels, priority, class,
/// seed, replicates and stop rules may differ.
std::vector<std::string> film_differences(const JobSpec& first, const JobSpec& other);

/// The arithmetic class in `build`; empty: it names none.
std::string arithmetic_of(std::string_view build_json);

/// "seed 0 (replicates 0 to 1, 64 samples), seed 5 (...)".
std::string ledger_words(const core::SampleLedger& ledger);
/// As a store keeps it, and back; empty for an empty text.
std::string ledger_json(const core::SampleLedger& ledger);
Parsed<core::SampleLedger> parse_ledger(std::string_view text);

}  // namespace api

/// Data stored with a film besides its samples: the text in a film file, and checks whether films
/// can be merged.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "api/answers/job_view.h"
#include "api/job/job_spec.h"
#include "api/problem.h"
#include "core/film/film_merge.h"

namespace api {

/// Returns JSON: version, job, spec, state, stop_reason, samples_by_error (0: no error chose their
/// number), finished_at, elapsed_seconds, error, warnings, samples (the ledger), build,
/// film_digest.
std::string film_text(const JobView& job, const core::SampleLedger& ledger,
                      std::string_view film_digest);

/// The part of the text that a merge needs.
struct FilmOrigin {
  JobSpec spec;
  core::StopReason stop_reason = core::StopReason::kNone;
  bool is_ended_by_error = false;  ///< an error estimate chose its sample count, possibly before a
                                   ///< time limit extended it
  double elapsed_seconds = 0;
  std::string build;        ///< JSON text; empty: unknown
  bool is_doubted = false;  ///< As JobView::is_doubted, when the film was stored.
};
/// Problems: 422 if it is not a text of film_text(); pointers are into the text.
Parsed<FilmOrigin> parse_film_text(std::string_view text);

/// Returns pointers into the job request where `other` differs from `first` in expectation, size or
/// layers, so that their films cannot be merged. Name, labels, priority, class, seed, replicates
/// and stop rules may differ.
std::vector<std::string> film_differences(const JobSpec& first, const JobSpec& other);

/// Returns the text of that member of `build`, for example "id"; empty if there is none.
std::string text_of_build(std::string_view build_json, const char* name);
/// Returns the arithmetic class in `build`; empty if there is none.
std::string arithmetic_of(std::string_view build_json);

/// Returns "seed 0 (replicates 0 to 1, 64 samples), seed 5 (...)".
std::string ledger_words(const core::SampleLedger& ledger);
/// Convert the ledger to and from stored text; empty for an empty text.
std::string ledger_json(const core::SampleLedger& ledger);
Parsed<core::SampleLedger> parse_ledger(std::string_view text);

}  // namespace api

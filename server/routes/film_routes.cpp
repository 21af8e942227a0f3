// Film download and merging.

#include <algorithm>
#include <memory>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "api/answers/film_view.h"
#include "api/answers/job_view.h"
#include "api/json/errors.h"
#include "api/json/limits.h"
#include "api/requests.h"
#include "core/base/check.h"
#include "core/film/film_format.h"
#include "core/film/tile_planes.h"
#include "core/integrators/registry.h"
#include "server/http/conditional.h"
#include "server/http/file_response.h"
#include "server/observe/turns.h"
#include "server/routes/answers.h"
#include "server/routes/context.h"
#include "server/store/files.h"

namespace server {
namespace {

using core::Error;
using core::ErrorCode;

core::FilmFormatLimits film_limits() {
  return {.side_max = static_cast<int>(api::limits::kFilmSide),
          .pixels_max = api::limits::kFilmPixels,
          .replicates_max = static_cast<int>(api::limits::kReplicates),
          .shares_max = static_cast<int>(api::limits::kLightShares),
          .text_bytes_max = static_cast<std::uint32_t>(api::limits::kBodyBytes),
          .file_bytes_max = static_cast<std::uint64_t>(api::limits::kFilmBytes)};
}

/// A film and the request that it was rendered for.
struct Source {
  core::FilmPart part;
  api::FilmOrigin origin;
  std::set<std::string> unverified = {};  ///< As in JobRecord.
};

Error placed(Error error, const std::string& where) {
  error.where = where;
  return error;
}

core::SampleLedger ledger_of(const api::JobView& view, const core::Film& film) {
  const core::RenderSettings& settings = view.spec.render;
  return view.ledger.empty() ? core::ledger_of(film, settings.seed, settings.first_replicate)
                             : view.ledger;
}

/// Returns the film of a job that has ended.
core::Result<Source> film_of_job(const RouteContext& context, const Job& job,
                                 const std::stop_token& stop) {
  const std::optional<double> ended = job.record().view.finished_at_unix_seconds;
  auto film = context.jobs.films().final_film(job, stop);
  if (!film) {
    return film.error();
  }
  const JobRecord record = job.record();
  const api::JobView& view = record.view;
  if (view.finished_at_unix_seconds != ended) {  // The record may describe another film.
    return Error{ErrorCode::kConflict, "the job was continued while its film was read", ""};
  }
  return Source{.part = {.film = *film, .ledger = ledger_of(view, **film)},
                .origin = {.spec = view.spec,
                           .stop_reason = view.stop_reason,
                           .is_ended_by_error = api::is_ended_by_error(view),
                           .elapsed_seconds = view.progress.elapsed_seconds,
                           .build = view.build,
                           .is_doubted = view.is_doubted},
                .unverified = record.unverified};
}

/// Returns whether the job request stored with the film describes its samples.
bool speaks_of(const api::JobSpec& spec, const core::FilmPart& part) {
  const core::Film& film = *part.film;
  const core::FilmSettings& settings = spec.render.film;
  const core::SampleRange& first = part.ledger.front();
  return settings.width == film.full_width() && settings.height == film.full_height() &&
         settings.area() == film.crop() && spec.render.replicates == film.replicates() &&
         core::parts_asked_for(settings) == film.recorded() &&
         settings.shares.size() == film.shares().size() &&
         core::pixel_errors(spec.render) == film.errors() && spec.render.seed == first.seed &&
         spec.render.first_replicate == first.first_replicate;
}

std::vector<core::LightShare> shares_of_text(const std::string& text) {
  const auto origin = api::parse_film_text(text);
  return origin ? origin->spec.render.film.shares : std::vector<core::LightShare>();
}

/// Reads an uploaded film file. Pre: film_bytes() accepted it.
core::Result<Source> film_of_asset(const RouteContext& context, const std::string& id,
                                   const Access& access) {
  const auto content = context.assets.read(id, access);
  if (!content) {
    return content.error();
  }
  auto file = core::read_film(**content, film_limits(), &shares_of_text);
  if (!file) {
    return file.error();
  }
  auto origin = api::parse_film_text(file->text);
  if (!origin) {
    const api::Problem& problem = origin.problem();
    const std::string reason = problem.errors.empty() ? problem.detail
                                                      : problem.errors.front().pointer + " " +
                                                            problem.errors.front().detail;
    return Error{ErrorCode::kInvalidArgument, "not a usable film: its text: " + reason, ""};
  }
  if (!speaks_of(origin->spec, file->part)) {
    return Error{ErrorCode::kInvalidArgument, "not a usable film: its text describes another film",
                 ""};
  }
  return Source{.part = std::move(file->part), .origin = std::move(*origin)};
}

/// Returns the memory needed for the film, before any is reserved. Errors: the film does not exist,
/// or the file is not a film.
core::Result<std::uint64_t> film_bytes(const RouteContext& context, const std::string& id,
                                       const Access& access) {
  if (api::is_uuid(id)) {
    const auto job = context.jobs.find(id, access);
    if (!job) {
      return job.error();
    }
    return core::film_shape((*job)->record().view.spec.render).bytes();
  }
  const auto bytes = context.assets.find(id, access);
  if (!bytes) {
    return bytes.error();
  }
  const auto fd = context.assets.open(id, access);
  if (!fd) {
    return fd.error();
  }
  std::vector<std::byte> head(core::kFilmHeadBytes);
  const auto got = read_at(fd->get(), head, 0, context.assets.path_of(id));
  if (!got) {
    return got.error();
  }
  head.resize(*got);
  const auto fits = core::check_film_head(head, *bytes, film_limits());
  return fits ? core::Result<std::uint64_t>(*bytes) : core::Result<std::uint64_t>(fits.error());
}

Response film(const RouteContext& context, Request& request, const JobPointer& job) {
  const auto film = context.jobs.films().final_film(*job, request.stop_token());
  if (!film) {
    return error_answer(request, film.error());
  }
  const api::JobView view = context.jobs.view(*job);
  const core::FilmPart part = {.film = *film, .ledger = ledger_of(view, **film)};
  const std::string digest = view.film_digest.empty() ? part.film->digest() : view.film_digest;
  const std::string text = api::film_text(view, part.ledger, digest);
  MadeSource source;
  source.bytes = core::film_file_bytes(*part.film, part.ledger, text.size());
  source.content_type = "application/vnd.tessera.film";
  source.etag = make_etag("f" + digest.substr(0, 32) + "-" + std::to_string(view.spec_version));
  source.cache_control = "no-cache";
  source.make = [part, text](const MadeSource::Sink& sink) {
    static_cast<void>(core::write_film(part, text, [&sink](std::span<const std::byte> piece) {
      return sink({reinterpret_cast<const char*>(piece.data()), piece.size()});
    }));
  };
  Response response = made_response(request, std::move(source));
  if (response.status == 200) {
    response.headers.set("Content-Disposition", "attachment; filename=\"" + view.id + ".film\"");
  }
  return response;
}

/// Returns why a film cannot be merged with the first one; empty if it can.
std::optional<api::Problem> misfit(const Source& first, const Source& next,
                                   const std::string& where) {
  const auto differences = api::film_differences(first.origin.spec, next.origin.spec);
  if (differences.empty()) {
    return std::nullopt;
  }
  std::vector<api::FieldError> errors;
  for (const std::string& pointer : differences) {
    errors.push_back(
        {where,
         "the film is not of the same image as the first one: its job differs at " + pointer});
  }
  return api::make_problem(ErrorCode::kInvalidArgument, std::move(errors));
}

/// Reserves memory for all films and the merged one. Errors: a film does not exist or is not a
/// film; kTooLarge, kUnavailable.
core::Result<MemoryGate::Lease> take_room(const RouteContext& context,
                                          const std::vector<std::string>& films,
                                          const Access& access) {
  std::uint64_t bytes = 0;
  for (std::size_t i = 0; i < films.size(); ++i) {
    const std::string where = "/films/" + std::to_string(i);
    const auto more = film_bytes(context, films[i], access);
    if (!more) {
      return placed(more.error(), where);
    }
    bytes += *more;
    if (bytes > static_cast<std::uint64_t>(api::limits::kFilmBytes)) {
      return Error{
          ErrorCode::kTooLarge,
          "the films have more than " + std::to_string(api::limits::kFilmBytes) + " bytes together",
          where};
    }
  }
  // An uploaded film is in memory as a file too while it is read; the merged film is at most as
  // large as all of them.
  auto lease =
      context.memory.take({.bytes = 3 * bytes, .tenant = access.tenant}, "merging the films");
  if (!lease) {
    return placed(lease.error(), lease.error().code == ErrorCode::kTooLarge ? "/films" : "");
  }
  return lease;
}

/// Returns the spec of the merged film's job.
api::JobSpec merged_spec(const api::JobSpec& first, const core::FilmPart& merged, int samples) {
  api::JobSpec spec = first;
  spec.name = "merged";
  spec.labels.clear();
  spec.job_class = api::JobClass::kNormal;
  spec.preview_key.reset();
  spec.webhook.reset();
  spec.retention_seconds.reset();
  spec.render.replicates = merged.film->replicates();
  spec.render.seed = merged.ledger.front().seed;
  spec.render.first_replicate = merged.ledger.front().first_replicate;
  spec.stop = core::StopRules{
      .samples_per_pixel = std::min(samples, static_cast<int>(api::limits::kSamplesPerPixel)),
      .confidence = first.stop.confidence};
  // Parses it as the store will: counts are rounded to whole sets.
  auto parsed = api::parse_job(api::spec_json(spec));
  CHECK(parsed);
  return std::move(parsed->spec);
}

JobService::FinishedFilm finished_film(const std::vector<Source>& sources, core::FilmPart merged) {
  JobService::FinishedFilm finished;
  int samples = 0;
  for (const core::SampleRange& range : merged.ledger) {
    samples += range.samples;
  }
  finished.spec = merged_spec(sources.front().origin.spec, merged, samples);
  finished.warnings.push_back("Merged from " + std::to_string(sources.size()) +
                              " films; samples: " + api::ledger_words(merged.ledger) + ".");
  finished.build = sources.front().origin.build;
  finished.arithmetic = api::arithmetic_of(finished.build);
  bool is_one_build = true;
  bool is_one_arithmetic = true;
  for (const Source& source : sources) {
    finished.elapsed_seconds += source.origin.elapsed_seconds;
    finished.unverified.insert(source.unverified.begin(), source.unverified.end());
    finished.is_doubted = finished.is_doubted || source.origin.is_doubted;
    // If an error estimate chose one film's count, it also influenced the sum's.
    if (source.origin.is_ended_by_error) {
      finished.stop_reason = core::StopReason::kRelativeError;
    }
    is_one_build = is_one_build && source.origin.build == finished.build;
    is_one_arithmetic =
        is_one_arithmetic && api::arithmetic_of(source.origin.build) == finished.arithmetic;
  }
  if (!is_one_arithmetic) {
    finished.warnings.emplace_back(
        "The films were made with different arithmetic; no single job would have exactly these "
        "bits.");
  } else if (!is_one_build) {
    finished.warnings.emplace_back("The films were made by different builds.");
  }
  // A single range with equal counts is the film of an ordinary job, which can be extended. Plans
  // and fits are not merged.
  const bool is_uniform = merged.ledger.size() == 1 &&
                          samples == finished.spec.stop.samples_per_pixel &&
                          finished.spec.render.adaptive.type == core::AdaptiveType::kNone &&
                          core::fit_type(finished.spec.render) == core::FitType::kNone;
  finished.film = std::move(merged.film);
  if (!is_uniform) {
    finished.ledger = std::move(merged.ledger);
  }
  return finished;
}

Response merge(const RouteContext& context, Turns& turns, Request& request) {
  const auto parsed = api::parse_merge(request.body);
  if (!parsed) {
    return problem_answer(request, parsed.problem());
  }
  const auto held = turns.take(request.access.tenant, request.stop_token());
  if (!held) {
    return error_answer(request, held.error());
  }
  const auto room = take_room(context, parsed->films, request.access);
  if (!room) {
    return error_answer(request, room.error());
  }
  std::vector<Source> sources;
  std::vector<core::FilmPart> parts;
  for (std::size_t i = 0; i < parsed->films.size(); ++i) {
    const std::string where = "/films/" + std::to_string(i);
    const std::string& id = parsed->films[i];
    const auto job = job_or_asset(context.jobs, id, request.access);
    auto source = !job   ? core::Result<Source>(job.error())
                  : *job ? film_of_job(context, **job, request.stop_token())
                         : film_of_asset(context, id, request.access);
    if (!source) {
      return error_answer(request, placed(source.error(), where));
    }
    if (const auto problem = i == 0 ? std::nullopt : misfit(sources.front(), *source, where)) {
      return problem_answer(request, *problem);
    }
    parts.push_back(source->part);
    sources.push_back(std::move(*source));
  }
  auto merged = core::merge_films(parts, static_cast<int>(api::limits::kReplicates));
  if (!merged) {
    return error_answer(request, merged.error());
  }
  JobService::FinishedFilm finished = finished_film(sources, std::move(*merged));
  finished.tenant = request.access.tenant;
  const auto job = context.jobs.add_finished(std::move(finished));
  if (!job) {
    return error_answer(request, job.error());
  }
  const api::JobView view = context.jobs.view(**job);
  Response response = json_response(201, api::job_json(view));
  response.headers.set("ETag", api::job_etag(view));
  response.headers.set("Cache-Control", "no-cache");
  response.headers.set("Location", "/v1/jobs/" + view.id);
  return response;
}

}  // namespace

void add_film_handlers(HandlerTable& table) {
  const auto turns = std::make_shared<Turns>(1);
  table["getFilm"] = {.of_job = &film};
  table["mergeFilms"] = {
      .handler = [turns](const RouteContext& context,
                         Request& request) { return merge(context, *turns, request); },
      .body = BodyPolicy::json(static_cast<std::uint64_t>(api::limits::kBodyBytes))};
}

}  // namespace server

#include "tests/simulation/requests.h"

#include <algorithm>
#include <optional>
#include <set>
#include <vector>

#include <nlohmann/json.hpp>

#include "api/job/job_spec.h"
#include "core/base/sha256.h"
#include "server/store/uuid.h"
#include "tests/simulation/faults.h"
#include "tests/simulation/model.h"

namespace simulation {
namespace {

using api::JobState;
using server::Access;
using Json = nlohmann::json;

constexpr std::size_t kThings = 4;  ///< Of each kind, at most that many of a tenant.
constexpr int kLarge = 65536;       ///< Samples of a job of a flood.
constexpr int kFlood = 8;           ///< Jobs of a flood: more than may render at once.
/// The smallest job must end within so many times what one slice and one sync take: its records
/// need some ten syncs, before each of which another's may come, and its slices wait for one of
/// each thread.
constexpr int kWaitMost = 100;
const std::string kFlooder = "flood";
const std::string kSmall = "small";

/// Content of an upload; `seed` is the value of its thing.
std::string content_of(const std::string& seed) {
  std::string content;
  for (Random random(std::stoull(seed)); content.size() < 20'000;) {
    content += std::to_string(random.next());
  }
  return content;
}

std::string kind_of(const std::string& thing) { return thing.substr(0, thing.find('/')); }
std::string name_of(const std::string& thing) { return thing.substr(thing.find('/') + 1); }

std::string batch_body(int kind, const std::vector<int>& samples) {
  Json body = {{"name", std::to_string(kind) + " {index}"},
               {"webhook", {{"url", "http://receiver.example"}}},
               {"template", Json::parse(body_of(kind, samples.front()))},
               {"matrix", {{"stop.samples_per_pixel", samples}}}};
  return body.dump();
}

}  // namespace

void Requests::note_answer(int tenant, int status, const std::string& words) {
  // The store may hold what an error of the disk answered.
  const bool is_refused = (status >= 400 && status < 500) || status == 503 || status == 507;
  note(tenant, (status >= 200 && status < 300 ? "ok-" : is_refused ? "no-" : "lost-") + words);
}

void Requests::upload(int tenant, Random& random) {
  const std::string seed = std::to_string(random.next() % 1'000'000'007);
  const std::string content = content_of(seed);
  const std::string thing = "upload/" + core::sha256_hex(content.data(), content.size());
  const bool is_cut = strikes(Fault::kRequestCut);
  note(tenant, (is_cut ? "ask-cut-upload " : "ask-upload ") + thing + " " + (is_cut ? "" : seed));
  const WireAnswer answer = send(
      server_,
      {.tenant = access_name(tenant), .line = "POST /v1/assets", .body = content, .is_cut = is_cut},
      random);
  if (is_cut) {
    if (answer.status >= 200 && answer.status < 300) {
      fail_("an upload that was cut is accepted: " + thing);
    }
    note(tenant, "ok-cut-upload " + thing);
    return;
  }
  note_answer(tenant, answer.status, "upload " + thing + " " + seed);
}

void Requests::put_preset(int tenant, Random& random) {
  const std::string thing =
      "preset/" + access_name(tenant) + "-" + std::to_string(random.below(kThings));
  const std::string samples = std::to_string(1 + random.below(1000));
  note(tenant, "ask-preset " + thing + " " + samples);
  const std::string body = R"({"job": {"stop": {"samples_per_pixel": )" + samples + "}}}";
  const WireAnswer answer = send(
      server_,
      {.tenant = access_name(tenant), .line = "PUT /v1/presets/" + name_of(thing), .body = body},
      random);
  note_answer(tenant, answer.status, "preset " + thing + " " + samples);
}

void Requests::post(int tenant, Random& random) {
  const std::string thing = "post/" + server::make_uuid();
  const int kind = static_cast<int>(random.below(3));
  const int samples = 2 << random.below(4);
  note(tenant, "ask-post " + thing + " " + std::to_string(samples));
  const WireRequest request = {.tenant = access_name(tenant),
                               .line = "POST /v1/jobs",
                               .body = body_of(kind, samples),
                               .key = name_of(thing)};
  const WireAnswer first = send(server_, request, random);
  const WireAnswer answer =
      first.status != 201 || random.chance(0.5) ? send(server_, request, random) : first;
  if (answer.status != 200 && answer.status != 201) {
    // The first may have been carried out.
    note_answer(tenant, first.status == 500 || first.status == 201 ? 500 : answer.status,
                "post " + thing);
    if (first.status == 201 && answer.status != 500 && answer.status != 503 &&
        answer.status != 507) {
      fail_("a repeated submission is refused: " + answer.body);
    }
    return;
  }
  const std::string id = Json::parse(answer.body).at("id").get<std::string>();
  if (first.status == 201 && Json::parse(first.body).at("id") != id) {
    fail_("one idempotency key made two jobs, " + id + " is one");
  }
  note(tenant, "ask-submit " + id + " " + std::to_string(kind) + " " + std::to_string(samples));
  note(tenant, "ok-submit " + id);
  note(tenant, "ok-post " + thing + " " + id);
  note(tenant, "forget " + thing);
}

void Requests::submit_batch(int tenant, Random& random) {
  const int kind = static_cast<int>(random.below(3));
  const std::string key = server::make_uuid();
  const WireRequest request = {.tenant = access_name(tenant),
                               .line = "POST /v1/batches",
                               .body = batch_body(kind, {2, 4, 8}),
                               .key = key};
  note(tenant, "ask-batch batch-key/" + key + " 1");
  const WireAnswer first = send(server_, request, random);
  if (first.status != 201) {
    note_answer(tenant, first.status, "batch batch-key/" + key + " 1");
    return;
  }
  const std::string id = Json::parse(first.body).at("id").get<std::string>();
  note(tenant, "ok-batch batch/" + id + " " + id);
  note(tenant, "forget batch-key/" + key);
  if (random.chance(0.5)) {
    const WireAnswer again = send(server_, request, random);
    if (again.status == 200 && Json::parse(again.body).at("id") != id) {
      fail_("one idempotency key made two batches, " + id + " is one");
    }
  }
}

void Requests::drop(int tenant, const std::string& thing, Random& random) {
  const std::string kind = kind_of(thing);
  const std::string path = kind == "upload"   ? "/v1/assets/"
                           : kind == "preset" ? "/v1/presets/"
                                              : "/v1/batches/";
  const std::string tenant_name = access_name(tenant);
  if (kind == "batch") {
    send(server_, {.tenant = tenant_name, .line = "POST " + path + name_of(thing) + "/cancel"},
         random);
  }
  note(tenant, "ask-drop-" + kind + " " + thing);
  const WireAnswer answer =
      send(server_, {.tenant = tenant_name, .line = "DELETE " + path + name_of(thing)}, random);
  if (answer.status == 404) {
    if (!ledger_.things().at(thing).may_be.contains("")) {
      fail_(thing + " is lost");
    }
    note(tenant, "forget " + thing);
    return;
  }
  note_answer(tenant, answer.status, "drop-" + kind + " " + thing);
}

std::optional<std::string> Requests::value_of(int tenant, const std::string& thing,
                                              Random& random) {
  const std::string kind = kind_of(thing);
  const Access access = Access::of(access_name(tenant));
  if (kind == "upload") {
    const auto content = server_.assets->read(name_of(thing), access);
    if (!content) {
      return content.error().code == core::ErrorCode::kNotFound ? std::optional(std::string())
                                                                : std::nullopt;
    }
    for (const std::string& seed : ledger_.things().at(thing).may_be) {
      const std::string expected = seed.empty() ? seed : content_of(seed);
      if (!seed.empty() &&
          std::equal(expected.begin(), expected.end(),
                     reinterpret_cast<const char*>((*content)->data()),
                     reinterpret_cast<const char*>((*content)->data()) + (*content)->size())) {
        return seed;
      }
    }
    return "another content";
  }
  if (kind == "batch") {
    const auto batch = server_.batches->view(name_of(thing), access);
    return batch                                              ? std::optional(batch->id)
           : batch.error().code == core::ErrorCode::kNotFound ? std::optional(std::string())
                                                              : std::nullopt;
  }
  if (kind == "preset") {
    const WireAnswer answer =
        send(server_, {.tenant = access_name(tenant), .line = "GET /v1/presets/" + name_of(thing)},
             random);
    if (answer.status == 200) {
      const Json preset = Json::parse(answer.body);
      return preset.at("job").at("stop").at("samples_per_pixel").dump();
    }
    return answer.status == 404 ? std::optional(std::string()) : std::nullopt;
  }
  return std::nullopt;
}

void Requests::check(int tenant, Random& random) {
  std::vector<std::string> own;
  for (const auto& [thing, known] : ledger_.things()) {
    if (known.tenant == tenant) {
      own.push_back(thing);
    }
  }
  for (const std::string& thing : own) {
    const auto value = value_of(tenant, thing, random);
    const auto known = ledger_.things().find(thing);
    if (value && known != ledger_.things().end() && !known->second.may_be.contains(*value)) {
      fail_(thing + " is '" + *value + "', not '" + *known->second.may_be.begin() + "'");
    }
  }
}

void Requests::act(int tenant, Random& random) {
  std::map<std::string, std::vector<std::string>> own;
  for (const auto& [thing, known] : ledger_.things()) {
    if (known.tenant == tenant) {
      own[kind_of(thing)].push_back(thing);
    }
  }
  check(tenant, random);
  const std::array<std::string, 4> kinds = {"upload", "preset", "batch", "post"};
  const std::string kind = kinds[random.below(kinds.size())];
  const std::vector<std::string>& things = own[kind];
  if (kind != "post" && !things.empty() && (things.size() >= kThings || random.chance(0.3))) {
    drop(tenant, things[random.below(things.size())], random);
  } else if (kind == "upload") {
    upload(tenant, random);
  } else if (kind == "preset") {
    put_preset(tenant, random);
  } else if (kind == "batch") {
    submit_batch(tenant, random);
  } else {
    post(tenant, random);
  }
}

void Requests::cancel_loading(int tenant) {
  const Access access = Access::of(access_name(tenant));
  const auto page = server_.batches->list(std::nullopt, 200, access);
  if (!page) {
    fail_("batches: " + page.error().message);
  }
  for (const api::BatchView& batch : page->batches) {
    const bool loads = std::any_of(batch.jobs.begin(), batch.jobs.end(),
                                   [](const auto& job) { return job.state == JobState::kLoading; });
    if (loads) {
      static_cast<void>(server_.batches->cancel(batch.id, access));
    }
  }
}

void Requests::settle(int tenant, Random& random, const std::function<bool()>& time_is_over) {
  const Access access = Access::of(access_name(tenant));
  std::set<std::string> left;
  const auto page = server_.batches->list(std::nullopt, 200, access);
  if (!page) {
    fail_("batches: " + page.error().message);
  }
  for (const api::BatchView& listed : page->batches) {
    for (bool has_ended = false; !has_ended; sleep_for(has_ended ? 0 : 10 * kSecond)) {
      const auto batch = server_.batches->view(listed.id, access);
      if (!batch) {
        fail_("batch " + listed.id + ": " + batch.error().message);
      }
      has_ended = std::all_of(batch->jobs.begin(), batch->jobs.end(),
                              [](const auto& job) { return api::is_final(job.state); });
      if (!has_ended && time_is_over()) {
        fail_("batch " + listed.id + " has not ended in the calm hour");
      }
      if (has_ended && server_.batches->retry(listed.id, access)) {
        note(tenant, "ok-retry-batch batch/" + listed.id + " " + listed.id);
        has_ended = false;
      }
    }
    const auto jobs = server_.batches->jobs(listed.id, access);
    for (const server::JobPointer& job : jobs ? *jobs : std::vector<server::JobPointer>()) {
      const api::JobView view = server_.jobs->view(*job);
      const int kind = std::stoi(view.spec.name);
      const int samples = view.spec.stop.samples_per_pixel.value_or(0);
      if (view.state == JobState::kFinished && view.film_digest != ledger_.digest(kind, samples)) {
        fail_("job " + job->id() + " of batch " + listed.id + " has the digest " +
              view.film_digest + ", undisturbed " + ledger_.digest(kind, samples));
      }
    }
    if (!ledger_.things().contains("batch/" + listed.id)) {  // Its submission has no answer.
      note(tenant, "ask-batch batch/" + listed.id + " " + listed.id);
    }
    drop(tenant, "batch/" + listed.id, random);
  }
  check(tenant, random);
  std::size_t posts = 0;
  std::vector<std::string> gone;
  for (const auto& [thing, known] : ledger_.things()) {
    if (known.tenant != tenant) {
      continue;
    }
    const std::string kind = kind_of(thing);
    posts += kind == "post" && known.may_be.size() > 1 ? 1U : 0U;
    if (kind == "post" || kind == "batch-key" ||
        (known.may_be.size() == 1 && known.may_be.contains(""))) {
      gone.push_back(thing);
    }
  }
  for (const std::string& thing : gone) {
    note(tenant, "forget " + thing);
  }
  const WireAnswer answer =
      send(server_, {.tenant = access_name(tenant), .line = "GET /v1/jobs?limit=200"}, random);
  if (answer.status != 200) {
    fail_("no list of jobs: " + answer.body);
  }
  const Json listed = Json::parse(answer.body);
  for (const Json& job : listed.at("jobs")) {
    const std::string id = job.at("id").get<std::string>();
    if (ledger_.jobs().contains(id)) {
      continue;
    }
    if (posts-- == 0) {
      fail_("job " + id + " was submitted by nobody, or twice");
    }
    const int width = job.at("spec").at("film").at("width").get<int>();
    note(tenant, "ask-submit " + id + " " +
                     std::to_string(width == 2   ? 0
                                    : width == 3 ? 1
                                                 : 2) +
                     " " + job.at("spec").at("stop").at("samples_per_pixel").dump());
  }
}

void Requests::end_flood() {
  for (const std::string& name : {kFlooder, kSmall}) {
    const Access access = Access::of(name);
    // A read may fail; a batch can be removed once its last slices have ended.
    for (int i = 0; i < 1000; ++i) {
      const auto page = server_.batches->list(std::nullopt, 200, access);
      if (page && page->batches.empty()) {
        break;
      }
      for (const auto& batch : page ? page->batches : std::vector<api::BatchView>()) {
        static_cast<void>(server_.batches->cancel(batch.id, access));
        static_cast<void>(server_.batches->remove(batch.id, access));
      }
      sleep_for(kSecond);
    }
  }
}

void Requests::flood(Random& random, Nanoseconds step, const std::function<bool()>& is_disturbed) {
  const auto submit = [&](const std::string& tenant, const std::string& body) {
    const WireAnswer answer =
        send(server_, {.tenant = tenant, .line = "POST /v1/batches", .body = body}, random);
    return answer.status == 201 ? Json::parse(answer.body).at("id").get<std::string>() : "";
  };
  std::vector<int> large;
  for (int i = 0; i < kFlood; ++i) {
    large.push_back(kLarge - i);
  }
  if (submit(kFlooder, batch_body(0, large)).empty()) {
    return;
  }
  sleep_for(static_cast<Nanoseconds>(random.exponential(10 * kSecond)));
  const Nanoseconds asked = now();
  const std::string batch = submit(kSmall, batch_body(0, {2}));
  const auto jobs = server_.batches->jobs(batch, Access::of(kSmall));
  while (jobs && !jobs->empty() && !is_disturbed()) {
    if (now() - asked > kWaitMost * step) {
      fail_("the smallest job waits for a flood, for " + std::to_string((now() - asked) / kSecond) +
            " s; it is " + std::string(api::to_text(jobs->front()->state())));
    }
    if (api::is_final(jobs->front()->state())) {
      note(0, "ok-small after " + std::to_string((now() - asked) * 1000 / kSecond) + " ms, step " +
                  std::to_string(step * 1000 / kSecond) + " ms");
      break;
    }
    sleep_for(kSecond / 100);
  }
  end_flood();
}

}  // namespace simulation

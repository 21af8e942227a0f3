// What operators do in a life (world.h), and what holds at rest.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <set>

#include <unistd.h>

#include "api/job/job_spec.h"
#include "api/json/error_codes.h"
#include "core/compare/comparison.h"
#include "server/store/database.h"
#include "server/store/key_table.h"
#include "server/store/uuid.h"
#include "tests/simulation/broker.h"
#include "tests/simulation/comparisons.h"
#include "tests/simulation/disk.h"
#include "tests/simulation/faults.h"
#include "tests/simulation/model.h"
#include "tests/simulation/requests.h"
#include "tests/simulation/server.h"
#include "tests/simulation/watch.h"
#include "tests/simulation/workers.h"
#include "tests/simulation/world.h"

namespace simulation {
namespace {

constexpr std::size_t kKeys = 16;
constexpr int kRestWaits = 60;  ///< seconds, after the last job has ended

/// Chance that what is in order at a tick fails, or what fails is in order again.
double chance_per_tick(Nanoseconds mean) {
  return static_cast<double>(kTick) / static_cast<double>(mean);
}

}  // namespace

/// is_unreadable: the keys cannot be read, so none is accepted.
void World::check_keys(bool is_unreadable) {
  for (const auto& [id, key] : ledger_.keys()) {
    if (key.is_there == true && !server_.keys->is_needed()) {
      fail("there are keys, and none is required");
    }
    if (key.is_there && (!is_unreadable || !*key.is_there) &&
        server_.keys->holder_of_hash(key.hash).has_value() != *key.is_there) {
      fail("key " + id + (*key.is_there ? " is not accepted" : " was removed and is accepted"));
    }
  }
}

void World::use_keys(Random& random) {
  const auto& known = ledger_.keys();
  std::string id;
  std::string verb = "add-key ";
  core::Status done = core::ok_status();
  if (known.size() < 2 || (known.size() < kKeys && random.chance(0.5))) {
    const server::KeyRow row = server::make_key("key").row;
    id = row.id;
    ledger_.note(0, "ask-" + verb + id + " " + row.token_hash);
    done = server_.key_table->insert(row);
  } else {
    id = std::next(known.begin(), static_cast<std::ptrdiff_t>(random.below(known.size())))->first;
    verb = "remove-key ";
    ledger_.note(0, "ask-" + verb + id);
    const auto removed = server_.key_table->remove(id);
    done = removed ? core::ok_status() : core::Status(removed.error());
  }
  ledger_.note(0, (done ? "ok-" : "no-") + verb + id);
  sleep_for(2 * kSecond);  // The ring reads them again each second.
  check_keys(false);
  if (verb == "remove-key " && done) {
    ledger_.note(0, "forget-key " + id);
  }
}

/// Copies the data directory to another disk, as an operator does, and checks the copy.
void World::back_up() {
  const std::string to = life_.root + ".backup";
  std::filesystem::remove_all(to);
  std::set<std::string> ids;
  for (const auto& [id, job] : ledger_.jobs()) {
    if (job.is_there && job.asked.empty() && !job.is_removed && job.retention_seconds == 0) {
      ids.insert(id);
    }
  }
  {
    // Another process, since the locks of a file are of a process; no transaction is waited for.
    const auto session = server_.database->session();
    share_files([&] {
      if (!life_.copier->copy(life_.root + "/data", to)) {
        fail("no backup");
      }
    });
  }
  auto copy = server::Database::open(to + "/tessera.db");
  if (!copy || !(*copy)->damage().empty()) {
    fail("a backup cannot be opened: " + (copy ? (*copy)->damage() : copy.error().message));
  }
  server::JobTable table(**copy);
  for (const std::string& id : ids) {
    const auto row = table.find(id);
    const KnownJob& known = ledger_.jobs()[id];
    if ((!row || !*row) && known.is_there && !known.is_removed && known.asked.empty()) {
      fail("job " + id + " is not in the backup");
    }
  }
  ledger_.note(0, "ok-backup");
}

/// At rest nothing is held.
void World::check_rest() {
  const server::JobService::Counts counts = server_.jobs->counts();
  if (counts.queued != 0 || counts.rendering != 0 || counts.held_bytes != 0) {
    fail("at rest " + std::to_string(counts.queued) + " jobs wait, " +
         std::to_string(counts.rendering) + " render, " + std::to_string(counts.held_bytes) +
         " bytes are held");
  }
  for (const auto& entry : std::filesystem::directory_iterator(server_.data->films_path())) {
    const std::string id = entry.path().stem().string();
    if (!server_.jobs->find(id, Access::operators())) {
      fail("at rest there is a film of no job: " + id);
    }
  }
  // The images of a job that has just ended may still be encoded from its film.
  for (int waits = 0; open_files(server_.data->films_path()) != 0; ++waits) {
    if (waits == kRestWaits) {
      fail("a minute after the last job " + std::to_string(open_files(server_.data->films_path())) +
           " films are open");
    }
    sleep_for(kSecond);
  }
  const auto drained = server_.jobs->drain();
  if (drained.running != 0) {
    fail("at rest " + std::to_string(drained.running) + " places are taken");
  }
  ledger_.note(0, "ok-check-rest");
}

/// The disk fills up and is freed; the server is drained for a while.
void World::operate(Random& random) {
  if (is_calm()) {
    spare_process();
  }
  const bool is_faulty = life_.is_faulty && !is_calm();
  fail_sometimes(is_faulty);
  if (is_full_ ? !is_faulty || random.chance(chance_per_tick(kOutage))
               : is_faulty && strikes(Fault::kDiskFull)) {
    is_full_ = !is_full_;
    was_full_ = true;
    ledger_.note(0, is_full_ ? "disk-full" : "disk-freed");
    set_disk_full(is_full_);
    wake(&is_full_, true);
  }
  if (is_draining_ ? !is_faulty || random.chance(chance_per_tick(kOutage))
                   : is_faulty && strikes(Fault::kDrained)) {
    is_draining_ = !is_draining_;
    ledger_.note(0, is_draining_ ? "drain" : "drain-ends");
    server_.jobs->set_draining(is_draining_);
  }
  if (is_faulty && strikes(Fault::kClockJumped)) {  // It was wrong by up to a day.
    jump_clock(static_cast<Nanoseconds>((2 * random.uniform() - 1) * kDay));
  }
  if (is_faulty && strikes(Fault::kReloaded)) {
    reload();
  }
  if (is_faulty && random.chance(chance_per_tick(kDay / 8))) {
    back_up();
  }
  if (random.chance(0.02)) {
    use_keys(random);
  }
  if (workers_) {
    set_broker_lossy(is_faulty);
    if (is_broker_up_ ? is_faulty && strikes(Fault::kQueueDown)
                      : !is_faulty || random.chance(chance_per_tick(kOutage))) {
      is_broker_up_ = !is_broker_up_;
      ledger_.note(0, is_broker_up_ ? "queue-up" : "queue-down");
      set_broker_up(is_broker_up_);
    }
  }
}

/// The configuration is read again: another key of the operator counts from now on.
void World::reload() {
  server::Config next = *server_.config.now();
  const std::string before = next.key;
  next.key = "key of the operator " + std::to_string(++reloads_);
  const std::string after = next.key;
  server_.config.set(std::move(next));
  if (!server_.keys->holder_of_hash(server::secret_hash(after)) ||
      (!before.empty() && server_.keys->holder_of_hash(server::secret_hash(before)))) {
    fail("a reloaded key is not the one that counts");
  }
}

}  // namespace simulation

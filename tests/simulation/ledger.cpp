#include "tests/simulation/ledger.h"

#include <fstream>
#include <sstream>

#include <fcntl.h>
#include <unistd.h>

#include "tests/simulation/executor.h"

namespace simulation {

Ledger::Ledger(std::string path)
    : path_(std::move(path)),
      fd_(::open(path_.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0600)) {}

void Ledger::note(int tenant, const std::string& words) {
  const Nanoseconds time = is_simulated() ? now() : time_;
  const std::string line = std::to_string(time) + " " + std::to_string(tenant) + " " + words + "\n";
  read_ += ::write(fd_, line.data(), line.size());
  apply(line);
}

void Ledger::catch_up() {
  std::ifstream file(path_);
  file.seekg(read_);
  for (std::string line; std::getline(file, line);) {
    read_ += static_cast<std::int64_t>(line.size()) + 1;
    apply(line);
  }
}

std::string Ledger::digest(int kind, int samples) const {
  const auto found = digests_.find({kind, samples});
  return found == digests_.end() ? "" : found->second;
}

std::vector<std::string> Ledger::last_lines(std::size_t count) const {
  std::ifstream file(path_);
  std::vector<std::string> lines;
  for (std::string line; std::getline(file, line);) {
    lines.push_back(line);
  }
  if (lines.size() > count) {
    lines.erase(lines.begin(), lines.end() - static_cast<std::ptrdiff_t>(count));
  }
  return lines;
}

std::uint64_t Ledger::count(const std::string& verb) const {
  const auto found = counts_.find(verb);
  return found == counts_.end() ? 0 : found->second;
}

void Ledger::apply_to_thing(int tenant, const std::string& verb, const std::string& id,
                            const std::string& value) {
  if (verb == "forget") {
    things_.erase(id);
    return;
  }
  KnownThing& thing = things_[id];
  thing.tenant = tenant;
  if (verb.starts_with("ask-")) {
    thing.before = thing.may_be;
    thing.may_be.insert(value);
  } else if (verb.starts_with("ok-")) {
    thing.may_be = {value};
  } else if (verb.starts_with("no-")) {
    thing.may_be = thing.before;
  }
}

void Ledger::apply(const std::string& line) {
  std::istringstream in(line);
  int tenant = 0;
  std::string verb;
  std::string id;
  in >> time_ >> tenant >> verb;
  ++counts_[verb];
  if (verb == "digest") {
    int kind = 0;
    int samples = 0;
    in >> kind >> samples >> digests_[{kind, samples}];
    return;
  }
  if (verb == "faults") {
    std::uint64_t times = 0;
    for (std::string kind; in >> kind >> times;) {
      counts_["fault " + kind] += times;
    }
    return;
  }
  if (verb == "ask-compare") {  // Until it is acknowledged, an older one may be forgotten for it.
    compared_.erase(tenant);
    return;
  }
  if (verb == "ok-compare") {
    std::string body;
    in >> id;
    std::getline(in >> std::ws, body);
    compared_[tenant] = {id, body};
    return;
  }
  if (verb == "fresh") {
    compared_.clear();
    jobs_.clear();
    keys_.clear();
    things_.clear();
    return;
  }
  if (verb.ends_with("key")) {
    in >> id;
    if (verb == "forget-key") {
      keys_.erase(id);
      return;
    }
    KnownKey& key = keys_[id];
    if (verb == "ask-add-key") {
      in >> key.hash;
    }
    key.is_there = verb == "ok-add-key"      ? std::optional(true)
                   : verb == "ok-remove-key" ? std::optional(false)
                                             : std::nullopt;
    return;
  }
  in >> id;
  if (id.find('/') != std::string::npos) {
    std::string value;
    in >> value;
    apply_to_thing(tenant, verb, id, value);
    return;
  }
  if (id.size() != 36) {  // Of no job.
    return;
  }
  if (verb == "forget") {
    jobs_.erase(id);
    return;
  }
  KnownJob& job = jobs_[id];
  if (verb == "ask-submit") {
    job = {.tenant = tenant};
    in >> job.kind >> job.samples >> job.retention_seconds;
    job.asked = "submit";
  } else if (verb == "ask-extend") {
    in >> job.asked_samples;
    job.asked = "extend";
  } else if (verb.starts_with("ask-")) {
    job.asked = verb.substr(4);
    job.is_paused = job.is_paused && job.asked != "resume";
  } else if (verb.starts_with("no-")) {
    job.asked.clear();
  } else if (verb == "ok-submit") {
    job.is_there = true;
    job.asked.clear();
  } else if (verb == "ok-cancel") {
    job.is_cancelled = true;
    job.is_paused = false;
    job.asked.clear();
  } else if (verb == "ok-pause") {
    job.is_paused = true;
    job.asked.clear();
  } else if (verb == "ok-extend") {
    job.samples = job.asked_samples;
    job.is_paused = false;
    job.is_cancelled = false;  // It had ended before.
    job.end.clear();
    job.asked.clear();
  } else if (verb == "ok-retry") {
    job.is_cancelled = false;  // It had failed before, although that was acknowledged.
    job.end.clear();
    job.asked.clear();
  } else if (verb == "ok-resume") {
    job.asked.clear();
  } else if (verb == "ok-remove") {
    job.is_removed = true;
    job.asked.clear();
  } else if (verb == "saw") {
    std::string state;
    int samples = 0;
    in >> state >> samples;
    job.is_there = true;
    job.samples = samples;
    job.asked.clear();
    job.end = state == "finished" || state == "cancelled" || state == "failed" ? state : "";
    job.is_cancelled = job.is_cancelled || state == "cancelled";
    job.is_paused = job.is_paused && job.end.empty();
  } else if (verb == "gone") {
    job.is_removed = true;
    job.asked.clear();
  } else if (verb == "damaged") {
    job.is_damaged = true;
  } else if (verb == "events") {
    in >> job.events >> job.events_hash;
  }
}

}  // namespace simulation

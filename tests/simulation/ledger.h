/// Ledger: what the server answered its clients, over all its lives. Also the trace of a run.
///
/// A line is noted before a request is sent and after it was answered, so that after a crash it is
/// known which requests have no answer: they may have been carried out or not.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace simulation {

struct KnownJob {
  int tenant = 0;
  int kind = 0;
  int samples = 0;
  int retention_seconds = 0;  ///< 0: it stays.
  bool is_there = false;      ///< Submitted, as was acknowledged or seen.
  bool is_removed = false;    ///< As was acknowledged.
  bool is_cancelled = false;  ///< As was acknowledged.
  bool is_paused = false;     ///< As was acknowledged.
  bool is_damaged = false;    ///< A bit of its film was flipped.
  std::string end = {};       ///< The final state that was seen; empty: none.
  std::string asked = {};     ///< A request without an answer; empty: none.
  int asked_samples = 0;
  std::size_t events = 0;  ///< Durable events that were seen, and their hash.
  std::uint64_t events_hash = 0;
};

struct KnownKey {
  std::string hash;
  std::optional<bool> is_there = {};  ///< As was acknowledged; empty: unknown.
};

/// Something with a name: an upload, a preset, a batch. Named `KIND/NAME` in lines.
struct KnownThing {
  int tenant = 0;
  std::set<std::string> may_be = {""};  ///< Its value; "": it is not there. Several: no answer yet.
  std::set<std::string> before = {};    ///< The last request.
};

class Ledger {
 public:
  /// path: of the file to which lines are added.
  explicit Ledger(std::string path);

  /// Adds a line and what it says. words: `VERB ID ARGUMENTS...`.
  void note(int tenant, const std::string& words);
  /// Reads the lines that another process has added.
  void catch_up();

  std::map<std::string, KnownJob>& jobs() { return jobs_; }
  const std::map<std::string, KnownKey>& keys() const { return keys_; }
  const std::map<std::string, KnownThing>& things() const { return things_; }
  /// Id and body of each tenant's newest comparison, if that was acknowledged.
  const std::map<int, std::pair<std::string, std::string>>& compared() const { return compared_; }
  /// Digest of an undisturbed film; empty: unknown.
  std::string digest(int kind, int samples) const;
  /// Returns the last lines of the trace.
  std::vector<std::string> last_lines(std::size_t count) const;
  std::uint64_t count(const std::string& verb) const;
  /// Virtual time of the last line, in nanoseconds.
  std::int64_t time() const { return time_; }

 private:
  void apply(const std::string& line);
  void apply_to_thing(int tenant, const std::string& verb, const std::string& id,
                      const std::string& value);

  std::string path_;
  int fd_ = -1;
  std::int64_t read_ = 0;  ///< Bytes of the file that are applied.
  std::int64_t time_ = 0;
  std::map<std::string, KnownJob> jobs_;
  std::map<std::string, KnownKey> keys_;
  std::map<std::string, KnownThing> things_;
  std::map<int, std::pair<std::string, std::string>> compared_;
  std::map<std::pair<int, int>, std::string> digests_;
  std::map<std::string, std::uint64_t> counts_;
};

}  // namespace simulation

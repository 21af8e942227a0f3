/// DatabaseMark: a file beside a database that tells what was committed, so that a loss is noticed.
///
/// SQLite drops all pages of its write-ahead log from the first damaged one on, and takes a missing
/// log for an empty one; it does not check the pages of the database itself. The mark holds the
/// number of pages of the log after the last commit, or, once the database is closed, its hash.
/// After a commit the mark is not synced: after a power failure it may tell less than the log
/// holds, never more. Format of the log: https://www.sqlite.org/fileformat2.html, 4.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "core/base/descriptor.h"
#include "core/base/result.h"

namespace server {

class DatabaseMark {
 public:
  explicit DatabaseMark(std::string database) : database_(std::move(database)) {}

  /// Compares files and mark; call it before SQLite opens the database. A loss is recorded in the
  /// file `*-damage`, and a copy of the log is kept. Returns what that file says; empty if there is
  /// none. Errors: of reading.
  core::Result<std::string> check() const;

  /// The first bytes of a log.
  static constexpr std::size_t kLogHeadBytes = 32;
  using LogHead = std::array<std::byte, kLogHeadBytes>;
  /// Notes that the log of that head has `pages` valid pages.
  void note_commit(const LogHead& head, std::uint32_t pages);
  /// Notes that nothing is known, before the log is written back to the database.
  void note_unknown();
  /// Notes the database's hash. Pre: closed, without a log.
  void note_closed();
  bool has_log() const;

 private:
  core::Result<std::optional<std::string>> find_loss() const;
  core::Result<std::optional<std::string>> find_loss_of_log(std::uint32_t salt1,
                                                            std::uint32_t salt2,
                                                            std::uint32_t pages) const;
  /// Changes with the mark and with the head of the log.
  std::string moment() const;
  void write(const std::string& words, bool is_synced);

  const std::string database_;
  core::UniqueFd mark_;  ///< Open from the first write on.
};

}  // namespace server

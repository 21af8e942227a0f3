#include "server/store/database_mark.h"

#include <cstddef>
#include <filesystem>
#include <span>
#include <sstream>
#include <system_error>
#include <vector>

#include <fcntl.h>

#include "core/base/byte_order.h"
#include "core/base/sha256.h"
#include "server/store/files.h"

namespace server {

namespace {

constexpr std::size_t kMarkBytes = 128;
constexpr std::size_t kPageHeadBytes = 24;

std::uint32_t word_at(std::span<const std::byte> bytes, std::size_t offset, bool is_big = true) {
  return is_big ? core::u32_big(bytes, offset) : core::u32_little(bytes, offset);
}

/// The running checksum of a log.
struct LogSum {
  bool is_big = true;  ///< Byte order of the summed words.
  std::uint32_t s0 = 0;
  std::uint32_t s1 = 0;

  void add(std::span<const std::byte> bytes) {
    for (std::size_t i = 0; i + 8 <= bytes.size(); i += 8) {
      s0 += word_at(bytes, i, is_big) + s1;
      s1 += word_at(bytes, i + 4, is_big) + s0;
    }
  }
  bool equals(std::span<const std::byte> bytes, std::size_t offset) const {
    return word_at(bytes, offset) == s0 && word_at(bytes, offset + 4) == s1;
  }
};

core::Result<std::string> hash_of(const std::string& path) {
  const auto fd = open_file(path, O_RDONLY);
  if (!fd) {
    return fd.error();
  }
  core::Sha256 hash;
  std::vector<std::byte> piece(std::size_t{1} << 20U);
  for (std::uint64_t offset = 0;;) {
    const auto got = read_at(fd->get(), piece, offset, path);
    if (!got) {
      return got.error();
    }
    if (*got == 0) {
      return hash.hex();
    }
    hash.add(piece.data(), *got);
    offset += *got;
  }
}

std::optional<std::string> text_of(const std::string& path, std::size_t most) {
  const auto fd = open_file(path, O_RDONLY);
  if (!fd) {
    return std::nullopt;
  }
  std::string text(most, '\0');
  const auto got = read_at(fd->get(), std::as_writable_bytes(std::span(text)), 0, path);
  text.resize(got ? *got : 0);
  return text;
}

}  // namespace

bool DatabaseMark::has_log() const {
  std::error_code code;
  const auto bytes = std::filesystem::file_size(database_ + "-wal", code);
  return !code && bytes > 0;
}

void DatabaseMark::write(const std::string& words, bool is_synced) {
  std::string text = seal(words);
  text.resize(kMarkBytes - 1, ' ');
  text += '\n';
  const std::string path = database_ + "-mark";
  // Without a mark, or with an old one, a loss may not be noticed; nothing else depends on it.
  if (!mark_) {
    if (auto opened = open_file(path, O_RDWR | O_CREAT)) {
      mark_ = *std::move(opened);
    }
  }
  if (mark_) {
    static_cast<void>(write_at(mark_.get(), std::as_bytes(std::span(text)), 0, path));
    if (is_synced) {
      static_cast<void>(sync_file(mark_.get(), path));
    }
  }
}

void DatabaseMark::note_commit(const LogHead& head, std::uint32_t pages) {
  std::ostringstream words;
  words << "log " << word_at(head, 16) << " " << word_at(head, 20) << " " << pages;
  write(words.str(), false);
}

void DatabaseMark::note_unknown() { write("unknown", true); }

void DatabaseMark::note_closed() {
  if (const auto hash = hash_of(database_)) {
    write("closed " + *hash, false);
  }
}

core::Result<std::optional<std::string>> DatabaseMark::find_loss_of_log(std::uint32_t salt1,
                                                                        std::uint32_t salt2,
                                                                        std::uint32_t pages) const {
  const std::string held = " It held " + std::to_string(pages) + (pages == 1 ? " page" : " pages") +
                           " of acknowledged changes.";
  if (!has_log()) {
    return std::optional<std::string>("The write-ahead log is missing." + held);
  }
  const std::string path = database_ + "-wal";
  const auto fd = open_file(path, O_RDONLY);
  if (!fd) {
    return fd.error();
  }
  LogHead head{};
  const auto got = read_at(fd->get(), head, 0, path);
  if (!got) {
    return got.error();
  }
  LogSum sum;
  sum.is_big = (word_at(head, 0) & 1U) != 0;
  sum.add(std::span(head).first(24));
  if (*got < head.size() || !sum.equals(head, 24)) {
    return std::optional<std::string>("The head of the write-ahead log is damaged." + held);
  }
  if (word_at(head, 16) != salt1 || word_at(head, 20) != salt2) {
    return std::optional<std::string>();  // All was written back, and the log begun anew.
  }
  const std::uint32_t page_bytes = word_at(head, 8);
  std::vector<std::byte> page(kPageHeadBytes + page_bytes);
  for (std::uint32_t i = 0; i < pages; ++i) {
    const auto read =
        read_at(fd->get(), page, kLogHeadBytes + std::uint64_t{i} * page.size(), path);
    if (!read) {
      return read.error();
    }
    sum.add(std::span<const std::byte>(page).first(8));
    sum.add(std::span<const std::byte>(page).subspan(kPageHeadBytes));
    if (*read < page.size() || word_at(page, 8) != salt1 || word_at(page, 12) != salt2 ||
        !sum.equals(page, 16)) {
      return std::optional<std::string>("The write-ahead log is " +
                                        std::string(*read < page.size() ? "cut short" : "damaged") +
                                        " at page " + std::to_string(i + 1) + "." + held);
    }
  }
  return std::optional<std::string>();
}

core::Result<std::optional<std::string>> DatabaseMark::find_loss() const {
  const auto text = text_of(database_ + "-mark", kMarkBytes);
  std::error_code code;
  // Its first words are not synced: a power failure may leave an empty file.
  if (!text || text->empty() || !std::filesystem::exists(database_, code)) {
    return std::optional<std::string>();
  }
  const std::string line = text->substr(0, text->find_last_not_of(" \n") + 1);
  const auto words = unseal(line);
  if (!words) {
    return std::optional<std::string>(
        "The file that tells what was committed is damaged, so losses cannot be noticed.");
  }
  std::istringstream in(*words);
  std::string kind;
  in >> kind;
  if (kind == "log") {
    std::uint32_t salt1 = 0;
    std::uint32_t salt2 = 0;
    std::uint32_t pages = 0;
    in >> salt1 >> salt2 >> pages;
    return find_loss_of_log(salt1, salt2, pages);
  }
  std::string known;
  in >> known;
  if (kind != "closed" || has_log()) {  // With a log: the process ended during its first commit.
    return std::optional<std::string>();
  }
  const auto hash = hash_of(database_);
  if (!hash) {
    return hash.error();
  }
  return *hash == known ? std::optional<std::string>()
                        : std::optional<std::string>(
                              "The database is not as it was when it was closed: it was damaged, "
                              "or replaced.");
}

std::string DatabaseMark::moment() const {
  return text_of(database_ + "-mark", kMarkBytes).value_or("") +
         text_of(database_ + "-wal", kLogHeadBytes).value_or("");
}

core::Result<std::string> DatabaseMark::check() const {
  std::string before = moment();
  auto loss = find_loss();
  // Another process may have committed, or written the log back, in the meantime.
  for (std::string now = moment(); loss && *loss && now != before; now = moment()) {
    before = std::move(now);
    loss = find_loss();
  }
  if (!loss) {
    return loss.error();
  }
  const std::string path = database_ + "-damage";
  constexpr std::size_t kDamageBytesMax = 65536;
  std::string known = text_of(path, kDamageBytesMax).value_or("");
  if (*loss && known.find(**loss) == std::string::npos) {
    known += **loss + "\n";
    const auto fd = open_file(path, O_RDWR | O_CREAT);
    if (!fd) {
      return fd.error();
    }
    if (const auto written = write_at(fd->get(), std::as_bytes(std::span(known)), 0, path);
        !written) {
      return written.error();
    }
    std::error_code code;  // Best effort: SQLite removes the damaged part.
    std::filesystem::copy_file(database_ + "-wal", database_ + "-wal-damaged",
                               std::filesystem::copy_options::skip_existing, code);
  }
  return known;
}

}  // namespace server

/// FilmFile: the durable copy of one job's film, films/<job>.film.
///
/// A checkpoint writes the changed tiles only, and is atomic: each tile has two slots, a checkpoint
/// writes the one that the last complete checkpoint does not need, syncs, then writes the other of
/// two heads, which names for each tile its slot and sequence number, and syncs again. What is cut
/// short leaves the checkpoint before it. Heads and slots carry a CRC-32; when the newest
/// checkpoint is damaged the one before it is taken, whole.
///
/// A meter's sums come after the slots, twice as well: each checkpoint writes all of them.
///
/// Of a film with splats all tiles are written, with the splats of one moment: a light path adds to
/// any of them.
///
/// Layout, little endian, parts aligned to 4096 bytes: head 0, head 1, then for each tile slot 0
/// and slot 1, then the meter. An object is used by one thread at a time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/film/film.h"
#include "core/render/render_task.h"
#include "server/store/files.h"

namespace server {

/// What stands beside the tiles.
struct FilmRecord {
  double elapsed_seconds = 0;
  /// More than 2,048 are thinned out.
  std::vector<core::ConvergencePoint> points;
  /// core::arithmetic_class() of the last writer; empty: not noted. At most 256 bytes.
  std::string arithmetic = {};
};

class FilmFile {
 public:
  /// Opens or makes the file. Errors: kNoSpace, kInternal.
  static core::Result<FilmFile> open(const std::string& path);

  /// Reads the last complete checkpoint into an empty film; a file without any leaves it empty.
  /// Errors: kConflict when the file is of a film of another geometry; kInternal for damage.
  core::Result<FilmRecord> restore(core::Film& film);

  /// Brings the file up to the film: tiles that changed since the last write or restore.
  /// is_final: the older slots give their space back. Errors: kNoSpace, kInternal; the checkpoint
  /// before it is still good then.
  core::Status write(const core::Film& film, const FilmRecord& record, bool is_final);

  /// The most that the file of a film takes, while it is being written.
  static std::uint64_t disk_bytes_max(const core::Film& film);
  /// Bytes that the file takes on the disk.
  std::uint64_t disk_bytes() const;

 private:
  struct Tile {
    std::uint32_t sequence = 0;  ///< Of the checkpoint that wrote it; 0: none.
    std::uint32_t slot = 0;      ///< Which slot that is.
    std::uint32_t revision = 0;  ///< Of the film's tile at that time.
  };
  struct Layout;
  struct Checkpoint;

  FilmFile(std::string path, UniqueFd fd) : path_(std::move(path)), fd_(std::move(fd)) {}
  core::Result<Checkpoint> read_checkpoint(const core::Film& film, int head) const;
  core::Status restore_tiles(core::Film& film, Checkpoint& checkpoint) const;
  core::Status write_tile(const core::Film& film, int tile, const Tile& before,
                          std::uint32_t sequence, const core::SplatState& splats);
  core::Status write_head(const core::Film& film, const FilmRecord& record, std::uint32_t sequence,
                          const core::SplatState& splats);
  core::Status restore_meter(core::Film& film, std::uint32_t sequence) const;
  core::Status write_meter(const core::Film& film, std::uint32_t sequence);
  void release_old_slots(const core::Film& film) const;

  std::string path_;
  UniqueFd fd_;
  std::uint32_t sequence_ = 0;  ///< Of the last complete checkpoint; it is in head sequence_ % 2.
  std::vector<Tile> tiles_;
  std::vector<std::uint64_t>
      versions_;  ///< Of the film's tiles when they were written or read; 0: never.
  std::vector<std::byte> buffer_;
};

}  // namespace server

/// FilmFile: the durable copy of one job's film, films/<job>.film.
///
/// A checkpoint writes only the changed tiles, and is atomic: each tile has two slots. A checkpoint
/// writes the slot that the last complete checkpoint does not need, syncs, then writes the other of
/// two heads, which holds for each tile its slot and sequence number, and syncs again. An
/// interrupted checkpoint leaves the previous one intact. Heads and slots carry a CRC-32; if the
/// newest checkpoint is damaged, the previous one is read as a whole.
///
/// A meter's sums follow the slots, also twice: each checkpoint writes all of them.
///
/// For a film with splats all tiles are written, with the splats of one moment: a light path may
/// add to any tile.
///
/// Layout, little endian, parts aligned to 4096 bytes: head 0, head 1, then for each tile slot 0
/// and slot 1, then the meter. An object is used by one thread at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/film/film.h"
#include "core/render/task/render_task.h"
#include "server/store/files.h"

namespace server {

/// Data stored besides the tiles.
struct FilmRecord {
  double elapsed_seconds = 0;
  /// More than 2,048 points are thinned out.
  std::vector<core::ConvergencePoint> points;
  /// core::arithmetic_class() of the last writer; empty: unknown. At most 256 bytes.
  std::string arithmetic = {};
};

class FilmFile {
 public:
  /// Opens or creates the file. Errors: kNoSpace, kInternal.
  static core::Result<FilmFile> open(const std::string& path);

  /// Reads the last complete checkpoint into an empty film; a file without one, or an error, leaves
  /// it empty. Errors: kConflict when the file belongs to a film of another geometry; kInternal for
  /// damage; kUnavailable when the disk could not read it.
  core::Result<FilmRecord> restore(core::Film& film);

  /// Writes the tiles that changed since the last write or restore. is_final: releases the disk
  /// space of the older slots. Errors: kNoSpace, kInternal; the previous checkpoint is then still
  /// valid.
  core::Status write(const core::Film& film, const FilmRecord& record, bool is_final);

  /// Returns the largest size of the film's file while it is being written.
  static std::uint64_t disk_bytes_max(const core::FilmShape& film);
  /// Returns the bytes that the file occupies on the disk.
  std::uint64_t disk_bytes() const;

 private:
  struct Tile {
    std::uint32_t sequence = 0;  ///< Checkpoint that wrote it; 0: none.
    std::uint32_t slot = 0;      ///< The slot with that sequence.
    std::uint32_t revision = 0;  ///< Revision of the film's tile when it was written.
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
  std::uint32_t sequence_ = 0;  ///< Last complete checkpoint; it is in head sequence_ % 2.
  std::vector<Tile> tiles_;
  std::vector<std::uint64_t>
      versions_;  ///< Versions of the film's tiles when last written or read; 0: never.
  std::vector<std::byte> buffer_;
};

}  // namespace server

#include "server/store/film_file.h"

#include <algorithm>
#include <cstring>
#include <span>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include "server/store/film_file_layout.h"

namespace server {

using core::Error;
using core::ErrorCode;
using core::Status;

namespace {

std::uint64_t align(std::uint64_t bytes) { return (bytes + kAlign - 1) / kAlign * kAlign; }

std::uint32_t crc_after_field(std::span<const std::byte> part) {
  const auto rest = part.subspan(8);  // Skips the magic and the CRC itself.
  return static_cast<std::uint32_t>(
      crc32_z(0, reinterpret_cast<const Bytef*>(rest.data()), rest.size()));
}

void seal(std::vector<std::byte>& part) {
  const std::uint32_t crc = crc_after_field(part);
  std::memcpy(part.data() + 4, &crc, sizeof crc);
}

template <typename Value>
void append(std::vector<std::byte>& part, const Value* values, std::size_t count) {
  const auto* bytes = reinterpret_cast<const std::byte*>(values);
  part.insert(part.end(), bytes, bytes + count * sizeof(Value));
}

template <typename Value>
void take(std::span<const std::byte>& rest, Value* values, std::size_t count) {
  // count is derived from sizes that were checked against rest; an empty vector may have a null
  // address.
  if (count > 0) {
    std::memcpy(static_cast<void*>(values), rest.data(), count * sizeof(Value));
  }
  rest = rest.subspan(count * sizeof(Value));
}

template <typename Value>
void append(std::vector<std::byte>& part, const std::vector<Value>& values) {
  append(part, values.data(), values.size());
}
void append(std::vector<std::byte>& part, const std::vector<core::PixelPlan>& plans) {
  for (const core::PixelPlan& plan : plans) {
    const StoredPlan stored = {{plan.from, plan.from}, {plan.to, plan.to}};
    append(part, &stored, 1);
  }
}

template <typename Value>
void take(std::span<const std::byte>& rest, std::vector<Value>& values) {
  take(rest, values.data(), values.size());
}
void take(std::span<const std::byte>& rest, std::vector<core::PixelPlan>& plans) {
  for (core::PixelPlan& plan : plans) {
    StoredPlan stored;
    take(rest, &stored, 1);
    plan = {stored.from[0], stored.to[0]};
  }
}

std::vector<core::ConvergencePoint> thinned(std::vector<core::ConvergencePoint> points) {
  while (points.size() > kPointsWritten) {
    std::vector<core::ConvergencePoint> every_second;
    for (std::size_t i = (points.size() - 1) % 2; i < points.size(); i += 2) {
      every_second.push_back(points[i]);
    }
    points = std::move(every_second);
  }
  return points;
}

Error damaged(const std::string& path, std::string_view what) {
  return Error{ErrorCode::kInternal, "the stored film is damaged: " + std::string(what), path};
}

/// A film whose reading failed may be whole: nothing may be concluded, and nothing be overwritten.
Error unread(const Error& failure) {
  return Error{ErrorCode::kUnavailable, "the stored film: " + failure.message, ""};
}

bool is_unread(const Error& error) { return error.code == ErrorCode::kUnavailable; }

void clear(core::Film& film) {
  for (int tile = 0; tile < film.tile_count(); ++tile) {
    if (film.tile_samples(tile) > 0) {
      core::TileState blank;
      blank.rect = film.tile_rect(tile);
      film.restore(tile, std::move(blank), 0);
    }
  }
}

}  // namespace

struct FilmFile::Layout {
  std::uint64_t head_bytes = 0;
  std::uint64_t slot_bytes = 0;
  std::size_t pixel_bytes = 0;

  explicit Layout(const core::FilmShape& film) {
    pixel_bytes = stored_pixel_bytes(film, core::shape_of(film));
    // The size of the first version, so that slots keep their offsets: kPointsWritten leaves room
    // for later fields.
    head_bytes = align(kFirstHeadBytes + kPointsMax * sizeof(PointFields) +
                       static_cast<std::uint64_t>(film.tile_count()) * sizeof(Tile) +
                       splat_head_bytes(film));
    slot_bytes = align(sizeof(SlotFields) + std::uint64_t{core::kTileSize} * core::kTileSize *
                                                static_cast<std::uint64_t>(pixel_bytes));
  }
  std::uint64_t head_offset(std::uint32_t sequence) const { return sequence % 2 * head_bytes; }
  std::uint64_t meter_offset(const core::FilmShape& film, std::uint32_t sequence) const {
    return slot_offset(film.tile_count(), 0) + sequence % 2 * align(meter_size(film));
  }
  std::uint64_t slot_offset(int tile, std::uint32_t slot) const {
    return 2 * head_bytes + (static_cast<std::uint64_t>(tile) * 2 + slot) * slot_bytes;
  }
};

struct FilmFile::Checkpoint {
  std::uint32_t sequence = 0;  ///< 0: this head was never written.
  FilmRecord record;
  double cpu_seconds_beside = 0;
  std::vector<Tile> tiles;
  core::SplatState splats;  ///< its tiles are read with the film's
};

core::Result<FilmFile> FilmFile::open(const std::string& path) {
  // Where nothing can be written, such as in a backup, it can still be checked.
  const bool is_fixed = ::access(path.c_str(), W_OK) != 0 && ::access(path.c_str(), F_OK) == 0;
  auto fd = open_file(path, is_fixed ? O_RDONLY : O_RDWR | O_CREAT);
  if (!fd) {
    return fd.error();
  }
  return FilmFile(path, std::move(*fd));
}

core::Result<FilmFile::Checkpoint> FilmFile::read_checkpoint(const core::Film& film,
                                                             int head) const {
  const Layout layout(film);
  std::vector<std::byte> part(layout.head_bytes);
  const auto got =
      read_at(fd_.get(), part, layout.head_offset(static_cast<std::uint32_t>(head)), path_);
  if (!got) {
    return unread(got.error());
  }
  HeadFields fields;
  const bool blank =
      *got < sizeof fields || std::all_of(part.begin(), part.begin() + sizeof fields,
                                          [](std::byte b) { return b == std::byte{0}; });
  if (blank) {
    return Checkpoint{};
  }
  std::memcpy(&fields, part.data(), sizeof fields);
  const bool is_first = fields.magic == kFirstHeadMagic;
  const std::size_t fields_bytes = is_first ? kFirstHeadBytes : sizeof fields;
  if (!is_head(fields.magic) || fields.bytes < fields_bytes || fields.bytes > *got) {
    return damaged(path_, "its head is invalid");
  }
  part.resize(fields.bytes);
  if (crc_after_field(part) != fields.crc) {
    return damaged(path_, "its head does not match its checksum");
  }
  const core::PixelRect rect = {fields.x, fields.y, fields.width, fields.height};
  if (rect != film.crop() || fields.full_width != film.full_width() ||
      fields.full_height != film.full_height() || fields.replicates != film.replicates() ||
      fields.parts != parts_of(film) ||
      fields.tile_count != static_cast<std::uint32_t>(film.tile_count())) {
    return Error{ErrorCode::kConflict, "the stored film has another size or other layers", ""};
  }
  const std::size_t text_begin = fields_bytes + fields.point_count * sizeof(PointFields) +
                                 fields.tile_count * sizeof(Tile) + splat_head_bytes(film);
  if (fields.bytes < text_begin || fields.bytes > text_begin + kArithmeticBytesMax) {
    return damaged(path_, "its head has the wrong length");
  }
  Checkpoint checkpoint;
  checkpoint.sequence = fields.sequence;
  checkpoint.record.elapsed_seconds = fields.elapsed_seconds;
  checkpoint.cpu_seconds_beside = is_first ? 0 : fields.cpu_seconds_beside;
  auto rest = std::span<const std::byte>(part).subspan(fields_bytes);
  for (std::uint32_t i = 0; i < fields.point_count; ++i) {
    PointFields point;
    take(rest, &point, 1);
    if (fields.magic == kHeadMagic) {
      checkpoint.record.points.push_back(point_of(point));
    }
  }
  checkpoint.tiles.resize(fields.tile_count);
  take(rest, checkpoint.tiles.data(), checkpoint.tiles.size());
  if (film.has_splats()) {
    core::SplatState& splats = checkpoint.splats;
    splats.light_samples.resize(static_cast<std::size_t>(film.unit_count()));
    splats.light_paths.resize(static_cast<std::size_t>(film.replicates()));
    splats.tiles = film.splats().tiles;
    take(rest, splats.light_samples.data(), splats.light_samples.size());
    take(rest, splats.light_paths.data(), splats.light_paths.size());
    take(rest, &splats.rejected_samples, 1);
    take(rest, &splats.rays, 1);
  }
  checkpoint.record.arithmetic.resize(rest.size());
  take(rest, checkpoint.record.arithmetic.data(), rest.size());
  return checkpoint;
}

Status FilmFile::restore_tiles(core::Film& film, Checkpoint& checkpoint) const {
  const Layout layout(film);
  std::vector<std::byte> part;
  for (int tile = 0; tile < film.tile_count(); ++tile) {
    const Tile& entry = checkpoint.tiles[static_cast<std::size_t>(tile)];
    core::TileState state;
    state.rect = film.tile_rect(tile);
    if (entry.sequence == 0) {
      continue;
    }
    const std::size_t pixels = pixels_of(state.rect);
    part.resize(sizeof(SlotFields) + pixels * layout.pixel_bytes);
    const auto got = read_at(fd_.get(), part, layout.slot_offset(tile, entry.slot % 2), path_);
    if (!got) {
      return unread(got.error());
    }
    SlotFields fields;
    std::memcpy(&fields, part.data(), sizeof fields);
    const std::size_t size = slot_size(film, state.rect, fields);
    if (*got < sizeof fields || *got < size || size > part.size() || fields.bytes != size) {
      return damaged(path_, "tile " + std::to_string(tile) + " is cut short");
    }
    part.resize(size);
    if (fields.magic != kSlotMagic || fields.sequence != entry.sequence ||
        fields.tile != static_cast<std::uint32_t>(tile) || crc_after_field(part) != fields.crc) {
      return damaged(path_, "tile " + std::to_string(tile) + " does not match its checksum");
    }
    state.samples = fields.samples;
    state.rejected_samples = fields.rejected_samples;
    state.rays = fields.rays;
    state.cpu_seconds = fields.cpu_seconds;
    state.span = {fields.span_from, fields.span_to};
    state.pilot_samples = fields.pilot_samples;
    core::resize_planes(state, pixels, shape_of(film, fields));
    auto rest = std::span<const std::byte>(part).subspan(sizeof fields);
    const auto take_array = [&](auto& values) { take(rest, values); };
    core::visit_arrays(state, false, take_array);
    if (film.has_splats()) {
      auto& sums = checkpoint.splats.tiles[static_cast<std::size_t>(tile)];
      sums.resize(state.pixels.size() * (1 + film.shares().size()));
      take(rest, sums);
    }
    core::visit_arrays(state, true, take_array);
    film.restore(tile, std::move(state), entry.revision);
  }
  if (film.has_splats()) {
    film.restore_splats(std::move(checkpoint.splats));
  }
  return core::ok_status();
}

Status FilmFile::restore_meter(core::Film& film, std::uint32_t sequence) const {
  if (film.meter_chunk_count() == 0) {
    return core::ok_status();
  }
  std::vector<std::byte> part(meter_size(film));
  const auto got = read_at(fd_.get(), part, Layout(film).meter_offset(film, sequence), path_);
  if (!got) {
    return unread(got.error());
  }
  MeterFields fields;
  std::memcpy(&fields, part.data(), sizeof fields);
  if (*got < part.size() || fields.magic != MeterFields{}.magic || fields.sequence != sequence ||
      fields.bytes != part.size() || crc_after_field(part) != fields.crc) {
    return damaged(path_, "the meter does not match its checksum");
  }
  auto rest = std::span<const std::byte>(part).subspan(sizeof fields);
  for (int i = 0; i < film.meter_chunk_count(); ++i) {
    MeterChunkFields chunk;
    take(rest, &chunk, 1);
    core::MeterChunk state = {.samples = static_cast<int>(chunk.samples),
                              .sums = {},
                              .rejected_samples = chunk.rejected_samples,
                              .rays = chunk.rays,
                              .cpu_seconds = chunk.cpu_seconds};
    state.sums.resize(film.meter_sums(i));
    take(rest, state.sums.data(), state.sums.size());
    film.commit_meter(i, std::move(state));
  }
  return core::ok_status();
}

Status FilmFile::write_meter(const core::Film& film, std::uint32_t sequence) {
  if (film.meter_chunk_count() == 0) {
    return core::ok_status();
  }
  MeterFields fields;
  fields.bytes = static_cast<std::uint32_t>(meter_size(film));
  fields.sequence = sequence;
  buffer_.clear();
  append(buffer_, &fields, 1);
  for (int i = 0; i < film.meter_chunk_count(); ++i) {
    core::MeterChunk state = film.meter_chunk(i);
    state.sums.resize(film.meter_sums(i));  // before its first sample
    const MeterChunkFields chunk = {state.samples, state.rejected_samples, state.rays,
                                    state.cpu_seconds};
    append(buffer_, &chunk, 1);
    append(buffer_, state.sums.data(), state.sums.size());
  }
  seal(buffer_);
  return write_at(fd_.get(), buffer_, Layout(film).meter_offset(film, sequence), path_);
}

core::Result<FilmRecord> FilmFile::restore(core::Film& film) {
  auto first = read_checkpoint(film, 0);
  auto second = read_checkpoint(film, 1);
  for (const auto* head : {&first, &second}) {
    if (!*head && is_unread(head->error())) {
      return head->error();
    }
  }
  const bool second_is_newer = second && (!first || second->sequence > first->sequence);
  for (auto* candidate : {second_is_newer ? &second : &first, second_is_newer ? &first : &second}) {
    if (!*candidate || (*candidate)->sequence == 0) {
      continue;
    }
    Status status = restore_tiles(film, **candidate);
    status = status ? restore_meter(film, (*candidate)->sequence) : status;
    if (!status) {
      clear(film);
      if (is_unread(status.error())) {
        return status.error();
      }
      continue;
    }
    film.add_cpu_seconds((*candidate)->cpu_seconds_beside);
    sequence_ = (*candidate)->sequence;
    tiles_ = std::move((*candidate)->tiles);
    versions_.clear();
    for (int tile = 0; tile < film.tile_count(); ++tile) {
      versions_.push_back(
          tiles_[static_cast<std::size_t>(tile)].sequence == 0 ? 0 : film.tile_version(tile));
    }
    return std::move((*candidate)->record);
  }
  // Checkpoint 1 is in head 1. If head 0 is still blank and head 1 is damaged, checkpoint 1 was cut
  // short and was never reported as saved.
  const bool is_blank =
      first && first->sequence == 0 &&
      (second ? second->sequence == 0 : second.error().code == ErrorCode::kInternal);
  if (is_blank) {
    tiles_.assign(static_cast<std::size_t>(film.tile_count()), Tile{});
    return FilmRecord{};
  }
  if (!first) {
    return first.error();
  }
  return second ? damaged(path_, "no complete checkpoint is left") : second.error();
}

Status FilmFile::write_tile(const core::Film& film, int tile, const Tile& before,
                            std::uint32_t sequence, const core::SplatState& splats) {
  // Reads the version first: later changes are written again.
  versions_[static_cast<std::size_t>(tile)] = film.tile_version(tile);
  const std::uint32_t revision = film.tile_revision(tile);
  core::TileState state = film.tile(tile);
  state.fit.resize(film.has_fit() ? state.pixels.size() : 0);
  const std::uint32_t slot = before.sequence == 0 ? 0 : 1 - before.slot;
  SlotFields fields;
  fields.sequence = sequence;
  fields.tile = static_cast<std::uint32_t>(tile);
  fields.revision = revision;
  fields.samples = state.samples;
  fields.pilot_samples = state.pilot_samples;
  fields.span_from = state.span.from;
  fields.span_to = state.span.to;
  fields.rejected_samples = state.rejected_samples;
  fields.rays = state.rays;
  fields.cpu_seconds = state.cpu_seconds;
  buffer_.clear();
  append(buffer_, &fields, 1);
  const auto append_array = [&](const auto& values) { append(buffer_, values); };
  core::visit_arrays(state, false, append_array);
  if (film.has_splats()) {
    append(buffer_, splats.tiles[static_cast<std::size_t>(tile)]);
  }
  core::visit_arrays(state, true, append_array);
  const auto bytes = static_cast<std::uint32_t>(buffer_.size());
  std::memcpy(buffer_.data() + 8, &bytes, sizeof bytes);
  seal(buffer_);
  if (auto status = write_at(fd_.get(), buffer_, Layout(film).slot_offset(tile, slot), path_);
      !status) {
    return status;
  }
  tiles_[static_cast<std::size_t>(tile)] =
      Tile{.sequence = sequence, .slot = slot, .revision = revision};
  return core::ok_status();
}

Status FilmFile::write_head(const core::Film& film, const FilmRecord& record,
                            std::uint32_t sequence, const core::SplatState& splats) {
  const auto points = thinned(record.points);
  const std::string_view text = std::string_view(record.arithmetic).substr(0, kArithmeticBytesMax);
  const core::PixelRect crop = film.crop();
  HeadFields fields;
  fields.bytes = static_cast<std::uint32_t>(sizeof fields + points.size() * sizeof(PointFields) +
                                            tiles_.size() * sizeof(Tile) + splat_head_bytes(film) +
                                            text.size());
  fields.sequence = sequence;
  fields.full_width = film.full_width();
  fields.full_height = film.full_height();
  fields.x = crop.x;
  fields.y = crop.y;
  fields.width = crop.width;
  fields.height = crop.height;
  fields.replicates = film.replicates();
  fields.parts = parts_of(film);
  fields.tile_count = static_cast<std::uint32_t>(tiles_.size());
  fields.point_count = static_cast<std::uint32_t>(points.size());
  fields.elapsed_seconds = record.elapsed_seconds;
  fields.cpu_seconds_beside = film.cpu_seconds_beside();
  buffer_.clear();
  append(buffer_, &fields, 1);
  for (const core::ConvergencePoint& point : points) {
    const PointFields stored = fields_of(point);
    append(buffer_, &stored, 1);
  }
  append(buffer_, tiles_.data(), tiles_.size());
  if (film.has_splats()) {
    append(buffer_, splats.light_samples.data(), splats.light_samples.size());
    append(buffer_, splats.light_paths.data(), splats.light_paths.size());
    append(buffer_, &splats.rejected_samples, 1);
    append(buffer_, &splats.rays, 1);
  }
  append(buffer_, text.data(), text.size());
  seal(buffer_);
  return write_at(fd_.get(), buffer_, Layout(film).head_offset(sequence), path_);
}

Status FilmFile::write(const core::Film& film, const FilmRecord& record, bool is_final) {
  tiles_.resize(static_cast<std::size_t>(film.tile_count()));
  versions_.resize(tiles_.size());
  const std::vector<Tile> before = tiles_;
  const std::vector<std::uint64_t> versions_before = versions_;
  const std::uint32_t sequence = sequence_ + 1;
  const core::SplatState splats = film.splats();
  Status status = core::ok_status();
  // A checkpoint covers one epoch: if another begins, the tiles are written again.
  bool again = true;
  while (again && status) {
    const std::uint32_t epoch = film.plan_epoch();
    for (int tile = 0; tile < film.tile_count() && status; ++tile) {
      const auto t = static_cast<std::size_t>(tile);
      if (film.has_splats() || film.tile_version(tile) != versions_[t]) {
        status = write_tile(film, tile, before[t], sequence, splats);
      }
    }
    again = film.plan_epoch() != epoch;
  }
  if (status) {
    status = write_meter(film, sequence);
  }
  // The slots must be on the disk before a head refers to them.
  if (status) {
    status = sync_file(fd_.get(), path_);
  }
  if (status) {
    status = write_head(film, record, sequence, splats);
  }
  if (status) {
    status = sync_file(fd_.get(), path_);
  }
  if (!status) {
    tiles_ = before;
    versions_ = versions_before;
    release_old_slots(film);  // Frees useless slots: the disk may be full.
    return status;
  }
  sequence_ = sequence;
  if (is_final) {
    release_old_slots(film);
  }
  return core::ok_status();
}

void FilmFile::release_old_slots(const core::Film& film) const {
  const Layout layout(film);
  // A failure only costs disk space: not every file system supports this.
  for (int tile = 0; tile < film.tile_count(); ++tile) {
    const Tile& entry = tiles_[static_cast<std::size_t>(tile)];
    const std::uint32_t unused = entry.sequence == 0 ? 0 : 1 - entry.slot;
    static_cast<void>(::fallocate(fd_.get(), FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE,
                                  static_cast<off_t>(layout.slot_offset(tile, unused)),
                                  static_cast<off_t>(layout.slot_bytes)));
  }
}

std::uint64_t FilmFile::disk_bytes_max(const core::FilmShape& film) {
  return Layout(film).meter_offset(film, 0) + 2 * align(meter_size(film));
}

std::uint64_t FilmFile::disk_bytes() const {
  struct stat info = {};
  return ::fstat(fd_.get(), &info) == 0 ? static_cast<std::uint64_t>(info.st_blocks) * 512U : 0;
}

}  // namespace server

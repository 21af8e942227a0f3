#include "server/http/message.h"

#include <algorithm>

#include <unistd.h>

#include "server/http/stream_gate.h"
#include "server/http/text.h"

namespace server {

std::optional<std::string_view> Headers::find(std::string_view name) const {
  for (const Field& field : fields_) {
    if (equal_ignoring_case(field.name, name)) {
      return field.value;
    }
  }
  return std::nullopt;
}

std::optional<std::string> Headers::joined(std::string_view name) const {
  std::optional<std::string> joined;
  for (const Field& field : fields_) {
    if (!equal_ignoring_case(field.name, name)) {
      continue;
    }
    if (joined) {
      *joined += ", " + field.value;
    } else {
      joined = field.value;
    }
  }
  return joined;
}

void Headers::add(std::string_view name, std::string_view value) {
  fields_.push_back({.name = std::string(name), .value = std::string(value)});
}

void Headers::set(std::string_view name, std::string_view value) {
  remove(name);
  add(name, value);
}

void Headers::remove(std::string_view name) {
  std::erase_if(fields_, [&](const Field& f) { return equal_ignoring_case(f.name, name); });
}

bool StringBodyReader::read(const Sink& sink) {
  constexpr std::size_t kPieceBytes = 64U << 10U;
  while (bytes_read_ < body_.size()) {
    const std::string_view piece =
        std::string_view(body_).substr(static_cast<std::size_t>(bytes_read_), kPieceBytes);
    bytes_read_ += piece.size();
    if (!sink(piece)) {
      return false;
    }
  }
  return true;
}

std::optional<std::string> Request::query(std::string_view name) const {
  for (const auto& [key, value] : query_params) {
    if (key == name) {
      return value;
    }
  }
  return std::nullopt;
}

std::string_view Request::path_param(std::string_view name) const {
  for (const auto& [key, value] : path_params) {
    if (key == name) {
      return value;
    }
  }
  return {};
}

void StreamGate::count(int more) {
  open_count_ += more;
  if (on_change_) {
    on_change_(open_count_);
  }
}

StreamSlot StreamGate::try_enter(const std::string& owner) {
  const core::MutexLock lock(mutex_);
  if (open_count_ >= limit_) {
    return {};
  }
  int& of_owner = of_owner_[owner];
  if (!owner.empty() && limit_of_owner_ > 0 && of_owner >= limit_of_owner_) {
    return {};
  }
  ++of_owner;
  count(1);
  return {this, owner};
}

void StreamGate::leave(const std::string& owner) {
  const core::MutexLock lock(mutex_);
  count(-1);
  if (const auto found = of_owner_.find(owner); found != of_owner_.end() && --found->second == 0) {
    of_owner_.erase(found);
  }
}

StreamSlot::~StreamSlot() {
  if (gate_ != nullptr) {
    gate_->leave(owner_);
  }
}

FileBody& FileBody::operator=(FileBody&& other) noexcept {
  std::swap(fd_, other.fd_);
  offset_ = other.offset_;
  size_ = other.size_;
  return *this;
}

FileBody FileBody::part(std::uint64_t offset, std::uint64_t size) && {
  FileBody part(std::move(*this));
  part.offset_ = offset;
  part.size_ = size;
  return part;
}

FileBody::~FileBody() {
  if (fd_ >= 0) {
    ::close(fd_);
  }
}

Response json_response(int status, std::string json) {
  Response response = text_response(status, "application/json", std::move(json));
  response.compressible = true;
  return response;
}

Response text_response(int status, std::string_view content_type, std::string text) {
  Response response;
  response.status = status;
  response.headers.add("Content-Type", content_type);
  response.body = std::move(text);
  return response;
}

Response bytes_response(int status, std::string_view content_type, SharedBytes bytes) {
  Response response;
  response.status = status;
  response.headers.add("Content-Type", content_type);
  response.body = std::move(bytes);
  return response;
}

Response stream_response(std::string_view content_type, StreamProducer producer, StreamSlot slot) {
  Response response;
  response.headers.add("Content-Type", content_type);
  response.headers.add("Cache-Control", "no-store");
  response.headers.add("X-Accel-Buffering", "no");
  response.body = StreamBody{.producer = std::move(producer), .slot = std::move(slot)};
  return response;
}

Response empty_response(int status) {
  Response response;
  response.status = status;
  return response;
}

}  // namespace server

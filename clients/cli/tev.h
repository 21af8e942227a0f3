/// Protocol of the image viewer tev (https://github.com/Tom94/tev, "Over the Network"): packets
/// [u32 length in bytes, including itself][u8 operation][payload], integers and floats little
/// endian, strings ended by a zero byte, arrays element by element.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "core/base/result.h"

namespace cli {

inline constexpr std::string_view kTevAddress = "127.0.0.1:14158";

/// CreateImage (operation 4): opens a black image, replacing one of the same name, and shows it.
/// channels: "R", "G", "B", "A" are the colours.
std::string tev_create_image(std::string_view name, int width, int height,
                             std::span<const std::string_view> channels);

struct TevRect {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;
};

/// UpdateImage (operation 6, the one with offsets and strides). values: width * height linear
/// values of the first channel, row by row from the top, then those of the next.
std::string tev_update_image(std::string_view name, const TevRect& rect,
                             std::span<const std::string_view> channels,
                             std::span<const float> values);

/// Returns whether the address is HOST:PORT; an IPv6 host needs brackets.
bool is_tev_address(const std::string& address);

class TevConnection {
 public:
  /// Errors: kInvalidArgument for an invalid address; kUnavailable if nothing listens there, with
  /// advice.
  static core::Result<TevConnection> open(const std::string& address);
  ~TevConnection();
  TevConnection(TevConnection&& other) noexcept;
  TevConnection& operator=(TevConnection&& other) noexcept;
  TevConnection(const TevConnection&) = delete;
  TevConnection& operator=(const TevConnection&) = delete;

  /// Errors: kUnavailable when tev has closed the connection or accepts no data for ten seconds.
  core::Status send(std::string_view packet);

 private:
  explicit TevConnection(int socket) : socket_(socket) {}
  int socket_;
};

}  // namespace cli

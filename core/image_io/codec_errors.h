/// Errors of libpng and libjpeg. Both report them by a function that must not return: it throws
/// std::runtime_error with the library's message. (Debian's libraries have the tables that unwind
/// their frames.) Warnings are ignored.
#pragma once

#include <cstdio>
#include <stdexcept>

#include <jpeglib.h>
#include <png.h>

namespace core {

[[noreturn]] inline void throw_png_error(png_structp /*png*/, png_const_charp message) {
  throw std::runtime_error(message);
}
inline void ignore_png_warning(png_structp /*png*/, png_const_charp /*message*/) {}

/// Returns `errors`, set up to throw.
inline jpeg_error_mgr* throwing_errors(jpeg_error_mgr& errors) {
  jpeg_std_error(&errors);
  errors.error_exit = [](j_common_ptr jpeg) {
    char message[JMSG_LENGTH_MAX];
    jpeg->err->format_message(jpeg, message);
    throw std::runtime_error(message);
  };
  errors.output_message = [](j_common_ptr /*jpeg*/) {};
  return &errors;
}

}  // namespace core

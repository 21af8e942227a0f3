/// Error codes of the service, in addition to the renderer's (core/base/result.h).
///
/// Stored jobs contain both, so a code never changes its meaning.
#pragma once

#include "core/base/result.h"

namespace api {

inline constexpr core::ErrorCode kUnauthorized{1};          ///< no access key, or an unknown one
inline constexpr core::ErrorCode kNotAcceptable{4};         ///< no format that the client accepts
inline constexpr core::ErrorCode kGone{6};                  ///< existed once and has been removed
inline constexpr core::ErrorCode kPreconditionFailed{7};    ///< changed since the client read it
inline constexpr core::ErrorCode kRangeNotSatisfiable{10};  ///< a byte range outside the content
inline constexpr core::ErrorCode kMisdirected{11};          ///< addressed to another host name
inline constexpr core::ErrorCode kTooManyRequests{14};      ///< a rate, a queue or a quota is full
inline constexpr core::ErrorCode kOverQuota{19};            ///< more storage than the quota allows
inline constexpr core::ErrorCode kForeignOrigin{20};        ///< a page of an origin not named
/// The largest number of all codes.
inline constexpr core::ErrorCode kLastErrorCode = kForeignOrigin;

}  // namespace api

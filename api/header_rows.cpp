#include "api/header_rows.h"

#include <array>

namespace api {
namespace {

constexpr std::string_view kText = R"({"type":"string"})";
constexpr std::string_view kNumber = R"({"type":"number"})";
constexpr std::string_view kInteger = R"({"type":"integer"})";

constexpr std::array kRequestHeaders = {
    HeaderRow{"Authorization", kText, "`Bearer KEY`."},
    HeaderRow{"Content-Encoding", kText, "Compression of the body: gzip, deflate or zstd."},
    HeaderRow{"Content-Type", kText, "Media type of the body."},
    HeaderRow{"Idempotency-Key", R"({"type":"string","minLength":1,"maxLength":255})",
              "Repeating the same key with the same body returns the first job (200)."},
    HeaderRow{"If-Match", kText, "ETag whose spec part must be current; otherwise 412."},
    HeaderRow{"If-None-Match", kText, "Known ETag: 304 while it is current."},
    HeaderRow{"If-Range", kText, "ETag of the bytes that Range continues."},
    HeaderRow{"Last-Event-ID", kText, "Continue after this event; `reset` announces lost events."},
    HeaderRow{"Prefer", kText,
              "`wait=N`: respond when the job has ended, or after N seconds (at most --max-wait)."},
    HeaderRow{"Range", kText, "Part of the bytes."},
    HeaderRow{"X-Request-Id", kText, "Id of the request for logs; else the server makes one."},
    HeaderRow{"traceparent", kText, "Trace context (W3C); its trace id is logged."},
    HeaderRow{"tracestate", kText, "Trace context (W3C); accepted beside traceparent."},
};

constexpr std::array kResponseHeaders = {
    HeaderRow{"Accept-Ranges", kText, "`bytes` where Range is honoured."},
    HeaderRow{"Content-Disposition", kText, "File name of a download."},
    HeaderRow{"Content-Range", kText, "Which bytes a 206 contains."},
    HeaderRow{"ETag", kText, "Revision, for If-None-Match and If-Match."},
    HeaderRow{"Link", kText, "`rel=\"next\"`: the next page of a list."},
    HeaderRow{"Location", kText, "Path of the created resource."},
    HeaderRow{"Preference-Applied", kText, "The `wait` in force."},
    HeaderRow{"RateLimit", kText, "Remaining requests of the key."},
    HeaderRow{"RateLimit-Policy", kText, "Requests that the key may send per minute."},
    HeaderRow{"Retry-After", kInteger, "Seconds to wait."},
    HeaderRow{"WWW-Authenticate", kText, "Why a key is required (RFC 6750)."},
    HeaderRow{"X-Request-Id", kText, "Id of the request, also in logs and problems."},
    HeaderRow{"X-Tessera-Bias", kText, "Systematic error of the image: none, consistent, biased."},
    HeaderRow{"X-Tessera-Denoiser", kText, "Denoiser of the image, if any."},
    HeaderRow{"X-Tessera-Error", kText,
              "Error of the image, and the low and high end of its interval; without the ends if "
              "they are unknown."},
    HeaderRow{"X-Tessera-Exposure", kNumber, "Exposure of a display format, in stops."},
    HeaderRow{"X-Tessera-Ignored", kText, "Query parameters without effect in this format."},
    HeaderRow{"X-Tessera-Range", kText, "Range of values that the colours show."},
    HeaderRow{"X-Tessera-Revision", kInteger, "Revision of the film in the image."},
    HeaderRow{"X-Tessera-Set-Aside", kText,
              "Share of the light that the image is shown without, such as 0.21%: its fireflies."},
    HeaderRow{"X-Tessera-Samples", kNumber, "Mean samples per pixel of the image."},
};

}  // namespace

std::span<const HeaderRow> request_headers() { return kRequestHeaders; }

std::span<const HeaderRow> response_headers() { return kResponseHeaders; }

}  // namespace api

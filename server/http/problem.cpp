#include "server/http/problem.h"

#include <array>

#include "api/json/errors.h"

namespace server {
namespace {

struct StatusText {
  int status;
  std::string_view phrase;
};
constexpr std::array kStatusTexts = {
    StatusText{100, "Continue"},
    StatusText{200, "OK"},
    StatusText{201, "Created"},
    StatusText{202, "Accepted"},
    StatusText{204, "No Content"},
    StatusText{206, "Partial Content"},
    StatusText{301, "Moved Permanently"},
    StatusText{302, "Found"},
    StatusText{303, "See Other"},
    StatusText{304, "Not Modified"},
    StatusText{307, "Temporary Redirect"},
    StatusText{308, "Permanent Redirect"},
    StatusText{400, "Bad Request"},
    StatusText{401, "Unauthorized"},
    StatusText{403, "Forbidden"},
    StatusText{404, "Not Found"},
    StatusText{405, "Method Not Allowed"},
    StatusText{406, "Not Acceptable"},
    StatusText{408, "Request Timeout"},
    StatusText{409, "Conflict"},
    StatusText{410, "Gone"},
    StatusText{411, "Length Required"},
    StatusText{412, "Precondition Failed"},
    StatusText{413, "Content Too Large"},
    StatusText{414, "URI Too Long"},
    StatusText{415, "Unsupported Media Type"},
    StatusText{416, "Range Not Satisfiable"},
    StatusText{417, "Expectation Failed"},
    StatusText{421, "Misdirected Request"},
    StatusText{422, "Unprocessable Content"},
    StatusText{424, "Failed Dependency"},
    StatusText{428, "Precondition Required"},
    StatusText{429, "Too Many Requests"},
    StatusText{431, "Request Header Fields Too Large"},
    StatusText{500, "Internal Server Error"},
    StatusText{501, "Not Implemented"},
    StatusText{503, "Service Unavailable"},
    StatusText{505, "HTTP Version Not Supported"},
    StatusText{507, "Insufficient Storage"},
};

}  // namespace

std::string_view reason_phrase(int status) {
  for (const StatusText& row : kStatusTexts) {
    if (row.status == status) {
      return row.phrase;
    }
  }
  return {};
}

Response problem_response(const api::Problem& problem, std::string_view instance) {
  Response response = text_response(problem.status, "application/problem+json",
                                    api::problem_json(problem, instance));
  response.headers.add("Cache-Control", "no-store");
  if (problem.status == 429 || problem.status == 503) {
    response.headers.add("Retry-After", "5");
  }
  return response;
}

Response problem_response(int status, std::string_view detail, std::string_view instance) {
  return problem_response(api::make_problem(status, std::string(detail)), instance);
}

Response no_stream_response(std::string_view instance) {
  return problem_response(503, "too many streams are open", instance);
}

}  // namespace server

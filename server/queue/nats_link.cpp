#include "server/queue/nats_link.h"

#include <memory>

#include "server/queue/handles.h"

namespace queue {
namespace {

/// Longest duration of a JetStream operation.
constexpr std::int64_t kWaitMs = 2000;
constexpr std::int64_t kReconnectMs = 250;

}  // namespace

core::Result<std::shared_ptr<NatsLink>> NatsLink::open(const Address& address,
                                                       const std::string& name) {
  auto place = host_and_port(address.url);
  if (!place) {
    return place.error();
  }
  natsOptions* made = nullptr;
  natsStatus s = natsOptions_Create(&made);
  const std::unique_ptr<natsOptions, void (*)(natsOptions*)> options(made, &natsOptions_Destroy);
  const auto refuse = [&s](const char* what) {
    core::Error error = nats_error(what, s);
    error.code = core::ErrorCode::kInvalidArgument;
    return error;
  };
  std::shared_ptr<NatsLink> link(new NatsLink());
  link->url_ = address.url;
  link->name_ = *std::move(place);
  link->handles_ = std::make_unique<Handles>();
  const auto on_reconnect = [](natsConnection*, void* closure) {
    ++static_cast<NatsLink*>(closure)->generation_;
  };
  s = s == NATS_OK ? natsOptions_SetURL(made, address.url.c_str()) : s;
  s = s == NATS_OK ? natsOptions_SetName(made, name.c_str()) : s;
  s = s == NATS_OK ? natsOptions_SetMaxReconnect(made, -1) : s;
  s = s == NATS_OK ? natsOptions_SetReconnectWait(made, kReconnectMs) : s;
  s = s == NATS_OK ? natsOptions_SetRetryOnFailedConnect(made, true, +on_reconnect, link.get()) : s;
  s = s == NATS_OK ? natsOptions_SetReconnectedCB(made, +on_reconnect, link.get()) : s;
  if (s != NATS_OK) {
    return refuse("the address of the queue");
  }
  if (address.url.starts_with("tls://")) {
    s = natsOptions_SetSecure(made, true);
  }
  if (s == NATS_OK && !address.ca.empty()) {
    s = natsOptions_LoadCATrustedCertificates(made, address.ca.c_str());
  }
  if (s != NATS_OK) {
    return refuse("the certificates of the queue");
  }
  if (!address.credentials.empty()) {
    s = natsOptions_SetUserCredentialsFromFiles(made, address.credentials.c_str(), nullptr);
  }
  if (s != NATS_OK) {
    return refuse("the credentials of the queue");
  }
  s = natsConnection_Connect(&link->handles_->connection, made);
  if (s != NATS_OK && s != NATS_NOT_YET_CONNECTED) {
    return refuse("the queue");
  }
  jsOptions js;
  jsOptions_Init(&js);
  js.Wait = kWaitMs;
  s = natsConnection_JetStream(&link->handles_->jetstream, link->handles_->connection, &js);
  if (s != NATS_OK) {
    return refuse("JetStream");
  }
  return link;
}

NatsLink::~NatsLink() {
  if (handles_ != nullptr && handles_->connection != nullptr) {
    natsConnection_Close(handles_->connection);
    jsCtx_Destroy(handles_->jetstream);
    natsConnection_Destroy(handles_->connection);
  }
}

bool NatsLink::is_connected() const {
  return natsConnection_Status(handles_->connection) == NATS_CONN_STATUS_CONNECTED;
}

}  // namespace queue

#include "server/queue/units.h"

#include <array>
#include <thread>
#include <utility>

#include "server/queue/handles.h"

namespace queue {

core::Status UnitPublisher::prepare(std::chrono::milliseconds silence) {
  if (!link_->is_connected()) {
    return core::Error{core::ErrorCode::kUnavailable,
                       "no connection to the queue at " + link_->name(), ""};
  }
  const auto version = server_version(link_->url());
  if (!version) {
    return version.error();
  }
  if (auto usable = check_version(*version); !usable) {
    return usable;
  }
  jsCtx* js = link_->handles_->jetstream;
  jsErrCode code{};
  // Units left by an earlier process or connection are obsolete. The stream stays: a new one would
  // count its messages from 1 again, and a worker that is done with an old message would remove the
  // new one of the same number.
  static_cast<void>(js_DeleteConsumer(js, kStream, kConsumer, nullptr, &code));
  static_cast<void>(js_PurgeStream(js, kStream, nullptr, &code));
  std::array<const char*, 1> subjects = {kSubject};
  jsStreamConfig stream;
  jsStreamConfig_Init(&stream);
  stream.Name = kStream;
  stream.Subjects = subjects.data();
  stream.SubjectsLen = static_cast<int>(subjects.size());
  stream.Retention = js_WorkQueuePolicy;
  stream.Storage = js_MemoryStorage;
  stream.Replicas = 1;
  natsStatus added = js_AddStream(nullptr, js, &stream, nullptr, &code);
  if (added != NATS_OK) {  // There is none, or one of another version with other settings.
    static_cast<void>(js_DeleteStream(js, kStream, nullptr, &code));
    added = js_AddStream(nullptr, js, &stream, nullptr, &code);
  }
  if (added != NATS_OK) {
    return nats_error("the stream of units cannot be created (is JetStream enabled?)", added);
  }
  jsConsumerConfig consumer;
  jsConsumerConfig_Init(&consumer);
  consumer.Durable = kConsumer;
  consumer.AckPolicy = js_AckExplicit;
  consumer.AckWait = std::chrono::nanoseconds(silence).count();
  consumer.MaxDeliver = -1;
  consumer.MaxAckPending = -1;
  if (const natsStatus s = js_AddConsumer(nullptr, js, kStream, &consumer, nullptr, &code);
      s != NATS_OK) {
    return nats_error("the consumer of units cannot be created", s);
  }
  return core::ok_status();
}

core::Status UnitPublisher::publish(std::string_view unit) {
  jsErrCode code{};
  const natsStatus s = js_Publish(nullptr, link_->handles_->jetstream, kSubject, unit.data(),
                                  static_cast<int>(unit.size()), nullptr, &code);
  return s == NATS_OK ? core::ok_status()
                      : core::Status(nats_error("a unit could not be published", s));
}

core::Result<std::uint64_t> UnitPublisher::messages() {
  jsErrCode code{};
  jsStreamInfo* info = nullptr;
  const natsStatus s = js_GetStreamInfo(&info, link_->handles_->jetstream, kStream, nullptr, &code);
  if (s != NATS_OK) {
    return nats_error("the stream of units does not answer", s);
  }
  const std::uint64_t count = info->State.Msgs;
  jsStreamInfo_Destroy(info);
  return std::uint64_t{count};
}

void UnitPublisher::request_report(const std::string& worker) {
  static_cast<void>(natsConnection_PublishString(link_->handles_->connection,
                                                 (kReportSubject + worker).c_str(), ""));
}

ReportRequests::ReportRequests(std::shared_ptr<NatsLink> link, const std::string& worker)
    : link_(std::move(link)), subject_(kReportSubject + worker) {}

ReportRequests::~ReportRequests() {
  natsSubscription_Destroy(static_cast<natsSubscription*>(subscription_));
}

bool ReportRequests::take() {
  if (subscription_ == nullptr) {
    natsSubscription* made = nullptr;
    if (!link_->is_connected() || natsConnection_SubscribeSync(&made, link_->handles_->connection,
                                                               subject_.c_str()) != NATS_OK) {
      return false;
    }
    subscription_ = made;  // The library subscribes again after a reconnection.
  }
  bool is_requested = false;
  natsMsg* message = nullptr;
  while (natsSubscription_NextMsg(&message, static_cast<natsSubscription*>(subscription_), 0) ==
         NATS_OK) {
    natsMsg_Destroy(message);
    is_requested = true;
  }
  return is_requested;
}

UnitPuller::UnitPuller(std::shared_ptr<NatsLink> link) : link_(std::move(link)) {}

UnitPuller::~UnitPuller() { unsubscribe(); }

void UnitPuller::unsubscribe() {
  natsSubscription_Destroy(static_cast<natsSubscription*>(subscription_));
  subscription_ = nullptr;
}

std::optional<UnitPuller::Unit> UnitPuller::next(std::chrono::milliseconds time) {
  const auto begin = std::chrono::steady_clock::now();
  const auto wait_the_rest = [&] {
    const auto spent = std::chrono::steady_clock::now() - begin;
    std::this_thread::sleep_for(
        std::min<std::chrono::nanoseconds>(time - spent, std::chrono::milliseconds(200)));
    return std::nullopt;
  };
  if (generation_ != link_->generation()) {
    unsubscribe();
    generation_ = link_->generation();
  }
  if (!link_->is_connected()) {
    return wait_the_rest();
  }
  jsErrCode code{};
  if (subscription_ == nullptr) {
    jsSubOptions options;
    jsSubOptions_Init(&options);
    options.Stream = kStream;
    options.Consumer = kConsumer;
    natsSubscription* made = nullptr;
    if (js_PullSubscribe(&made, link_->handles_->jetstream, kSubject, kConsumer, nullptr, &options,
                         &code) != NATS_OK) {
      return wait_the_rest();  // No coordinator has created the consumer yet.
    }
    subscription_ = made;
  }
  natsMsgList list{};
  const natsStatus s = natsSubscription_Fetch(&list, static_cast<natsSubscription*>(subscription_),
                                              1, time.count(), &code);
  if (s != NATS_OK) {
    if (s != NATS_TIMEOUT) {
      unsubscribe();
      return wait_the_rest();
    }
    return std::nullopt;
  }
  natsMsg* message = std::exchange(list.Msgs[0], nullptr);
  natsMsgList_Destroy(&list);
  return Unit(std::string(natsMsg_GetData(message),
                          static_cast<std::size_t>(natsMsg_GetDataLength(message))),
              message, *link_, generation_);
}

UnitPuller::Unit::~Unit() { natsMsg_Destroy(static_cast<natsMsg*>(message_)); }

// A lost message is harmless: the coordinator knows which units are open. A broker that restarted
// counts from 1 again: the answer would be to another unit.
bool UnitPuller::Unit::is_current() const { return generation_ == link_.generation(); }

void UnitPuller::Unit::renew() const {
  if (is_current()) {
    static_cast<void>(natsMsg_InProgress(static_cast<natsMsg*>(message_), nullptr));
  }
}
void UnitPuller::Unit::done() const {
  if (is_current()) {
    static_cast<void>(natsMsg_Ack(static_cast<natsMsg*>(message_), nullptr));
  }
}
void UnitPuller::Unit::hand_back() const {
  if (is_current()) {
    static_cast<void>(natsMsg_Nak(static_cast<natsMsg*>(message_), nullptr));
  }
}

}  // namespace queue

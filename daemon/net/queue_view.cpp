// SPDX-License-Identifier: MIT
// What the dispatcher shows of its queue and its clients.
#include "daemon/net/queue_view.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "daemon/net/dispatcher.h"
#include "daemon/net/session.h"

namespace pmcd::net {

RequestView Dispatcher::view(Key key) const {
  const Transfer& transfer = transfers_.at(key);
  const scheduler::Request& request = *scheduler().find(key);
  const auto ago = [now = now()](scheduler::Time then) {
    return std::chrono::duration<double>(std::max(now - then, scheduler::Time{0})).count();
  };
  RequestView view;
  view.client = request.session;
  view.address = transfer.session->peer();
  if (transfer.of) view.mesh = transfer.of->mesh.summary.name;
  view.packet = request.packet;
  view.bytes = request.size_bytes;
  view.bytes_left = request.remaining_bytes();
  view.asked_seconds_ago = ago(request.asked_at);
  view.queued_seconds_ago = ago(request.queued_at);
  return view;
}

QueueView Dispatcher::queue(std::size_t most) const {
  QueueView queue;
  queue.waiting = scheduler().waiting();
  queue.running = scheduler().running();
  const auto add = [&](RequestView view) {
    if (queue.requests.size() < most) queue.requests.push_back(std::move(view));
  };
  for (const auto state : {RequestView::State::running, RequestView::State::blocked}) {
    for (const turns::Turns::Progress& running : turns_.running()) {
      if (running.is_stopped != (state == RequestView::State::blocked)) continue;
      RequestView one = view(running.key);
      one.state = state;
      one.bytes_left = one.bytes - std::min(one.bytes, running.sent_bytes);
      add(std::move(one));
    }
  }
  std::size_t rank = 0;
  for (const scheduler::Ranked& ranked : scheduler().ranking(most, now())) {
    RequestView one = view(ranked.key);
    one.rank = ++rank;
    one.reason = ranked.reason;
    add(std::move(one));
  }
  for (const auto& [key, transfer] : transfers_) {
    if (queue.requests.size() == most) break;
    if (!scheduler().is_held(key)) continue;
    RequestView one = view(key);
    one.state = RequestView::State::blocked;
    one.reason = "its client is being served";
    queue.requests.push_back(std::move(one));
  }
  queue.more = queue.waiting + queue.running - queue.requests.size();
  return queue;
}

void shorten(QueueView& queue, std::size_t most, scheduler::SessionKey client) {
  if (queue.requests.size() <= most) return;
  const auto behind = queue.requests.begin() + static_cast<std::ptrdiff_t>(most);
  const auto end = std::remove_if(behind, queue.requests.end(), [client](const RequestView& request) {
    return request.client != client && request.rank != 1;
  });
  queue.more += static_cast<std::size_t>(queue.requests.end() - end);
  queue.requests.erase(end, queue.requests.end());
}

ClientView Dispatcher::client(scheduler::SessionKey session) const {
  ClientView view;
  const scheduler::Client* client = scheduler().clients().find(session);
  if (client == nullptr) return view;
  view.speed = client->speed;
  view.weight = client->weight;
  view.acknowledged = client->acknowledged;
  view.taking = scheduler().clients().taking(session, now());
  const auto [waiting, running] = scheduler().counts(session);
  view.waiting = waiting;
  view.running = running;
  return view;
}

}  // namespace pmcd::net

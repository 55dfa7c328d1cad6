#include <fmt/format.h>

#include <utility>

#include "common/protocol/cluster_client.h"

// Jobs beside frames: what a bake sends to servers and hears of them. Connections are in cluster_client.cpp.
namespace umbriel::protocol {

using wire::MessageType;

namespace {

// News that nobody has taken. More comes only from a server that talks without being asked.
constexpr std::size_t kMaxNews = 1 << 16;

}  // namespace

std::uint32_t ClusterClient::provideBlobs(std::vector<wire::Blob> blobs) {
    finishJobs();
    for (wire::Blob& blob : blobs) _jobBlobs.emplace(blob.ref.hash, std::move(blob.data));
    _hasJobs = true;
    for (std::size_t i = 0; i < _servers.size(); ++i)
        if (_servers[i].session.connected()) sessionBegun(i);
    return ++_jobSeries;
}

void ClusterClient::finishJobs() {
    _hasJobs = false;
    _jobBlobs.clear();
    _jobNews.clear();
}

Link* ClusterClient::jobLink(JobPeer peer) {
    if (_error || peer.server >= _servers.size()) return nullptr;
    const Session& session = _servers[peer.server].session;
    return session.connected() && session.number == peer.session ? link(session.control) : nullptr;
}

void ClusterClient::offerJob(JobPeer peer, const JobRequest& request) {
    Link* control = jobLink(peer);
    if (!control) return;
    wire::JobOffer offer;
    offer.job = request.job;
    offer.attempt = request.attempt;
    offer.leaseMilliseconds = static_cast<std::uint32_t>(request.lease / std::chrono::milliseconds(1));
    offer.kind = request.kind;
    offer.payload = request.payload;
    offer.blobs = request.blobs;
    control->send(offer);  // a full queue: the server reads nothing and is lost soon
}

void ClusterClient::cancelJob(JobPeer peer, std::uint64_t job, std::uint32_t attempt) {
    if (Link* control = jobLink(peer)) control->send(wire::JobCancel{job, attempt});
}

void ClusterClient::fetchResult(JobPeer peer, const wire::BlobRef& result) {
    Link* control = jobLink(peer);
    if (!control || !_servers[peer.server].session.results->expect(result)) return;
    control->send(wire::BlobWanted{{result.hash}});
}

Result<void> ClusterClient::jobMessage(std::size_t index, MessageType type, std::span<const std::byte> payload) {
    Session& session = _servers[index].session;
    JobNews news;
    news.peer = {index, session.number};
    if (type == MessageType::JobLease) {
        auto lease = wire::decode<wire::JobLease>(payload);
        if (!lease) return lease.error();
        news.kind = JobNews::Kind::Lease;
        news.lease = *lease;
    } else if (type == MessageType::JobDone) {
        auto done = wire::decode<wire::JobDone>(payload);
        if (!done) return done.error();
        news.kind = JobNews::Kind::Done;
        news.done = std::move(*done);
    } else {
        const auto data = wire::decode<wire::BlobData>(payload);
        if (!data) return data.error();
        return resultReceived(index, session.results->part(*data));
    }
    return tell(std::move(news));
}

Result<void> ClusterClient::resultReceived(std::size_t index, Result<std::optional<wire::Blob>> blob) {
    if (!blob) return blob.error();
    if (!*blob) return {};
    JobNews news;
    news.kind = JobNews::Kind::Result;
    news.peer = {index, _servers[index].session.number};
    news.result = std::move(**blob);
    return tell(std::move(news));
}

Result<void> ClusterClient::tell(JobNews news) {
    if (_jobNews.size() >= kMaxNews) return failure("it says more of jobs than anybody asked for");
    tellOfJobs(std::move(news));
    return {};
}

void ClusterClient::more(ConnectionId, Peer& peer, std::span<const std::byte> bytes, TimePoint now) {
    const std::size_t server = placeOf(peer.tag).server;
    if (const auto done = resultReceived(server, _servers[server].session.results->more(bytes)); !done)
        lose(server, fmt::format("{}: {}", textOf(server), done.error().message), now);
}

std::size_t ClusterClient::roomForMore(ConnectionId connection, const Peer& peer,
                                       std::span<std::span<std::byte>> places) {
    const Session& session = _servers[placeOf(peer.tag).server].session;
    return session.bulk == connection ? session.results->room(places) : 0;
}

void ClusterClient::morePlaced(ConnectionId, Peer& peer, std::size_t count, TimePoint now) {
    const std::size_t server = placeOf(peer.tag).server;
    if (const auto done = resultReceived(server, _servers[server].session.results->filled(count)); !done)
        lose(server, fmt::format("{}: {}", textOf(server), done.error().message), now);
}

void ClusterClient::sessionBegun(std::size_t index) {
    Session& session = _servers[index].session;
    if (session.number == 0) session.number = ++_connectedSessions;
    JobNews news;
    news.kind = JobNews::Kind::Begun;
    news.peer = {index, session.number};
    if (const wire::Hello* hello = serverHello(index)) news.text = hello->name;
    tellOfJobs(std::move(news));
}

void ClusterClient::sessionEnded(std::size_t index, const Session& session, const std::string& reason) {
    if (session.number == 0) return;
    JobNews news;
    news.kind = JobNews::Kind::Ended;
    news.peer = {index, session.number};
    news.text = reason;
    tellOfJobs(std::move(news));
}

void ClusterClient::tellOfJobs(JobNews news) {
    if (_hasJobs) _jobNews.push_back(std::move(news));
}

}  // namespace umbriel::protocol

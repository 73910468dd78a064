# SPDX-License-Identifier: MIT
"""What no rule can beat: arithmetic on bytes, rates and delays. It knows no measurement."""

import heapq
import math

import network

_CHUNK_HEAD_BYTES = 34
_CHUNK_BYTES = 256 * 1024
_END_BYTES = 13
# Connect, hello, connect again, join, request: each waits for the one before.
_ROUND_TRIPS = 5
DELAYS_TO_REQUEST = 2 * _ROUND_TRIPS - 1

FIGURES = ("packet 0", "10 %", "5 %", "1 %", "end")
_SHARES = {"10 %": 0.1, "5 %": 0.05, "1 %": 0.01}


def packet_of(figure, levels):
    """The packet that brings what the figure waits for; an error that no level reaches is reached by none before the
    end."""
    if figure == "packet 0":
        return 0
    share = _SHARES.get(figure)
    first = levels[0]["error_rms"]
    if share is not None and first is not None:
        for number, level in enumerate(levels):
            if level["error_rms"] is not None and level["error_rms"] <= share * first:
                return number
    return len(levels) - 1


def reached(figure, levels):
    """Whether a level has that error at all."""
    share = _SHARES.get(figure)
    return share is None or any(level["error_rms"] is not None and level["error_rms"] <= share * levels[0]["error_rms"]
                                for level in levels)


def stream_bytes(levels, packet):
    """Bytes of the data channel up to the end of that packet, in the fewest frames."""
    sizes = [level["bytes"] for level in levels[:packet + 1]]
    return (sum(size + math.ceil(size / _CHUNK_BYTES) * _CHUNK_HEAD_BYTES for size in sizes)
            + (len(sizes) - 1) * _END_BYTES)


def _seconds(stream, kbit, head_bytes):
    """That the bytes need on a line, which lets its first burst through at once."""
    wire = stream + math.ceil(stream / network.SEGMENT_BYTES) * head_bytes
    return max(0.0, wire - network.burst_bytes(kbit)) * 8 / (kbit * 1000)


def _on_uplink(stream, uplink_kbit):
    return _seconds(stream, uplink_kbit, network.HEADER_BYTES + network.ETHERNET_BYTES)


def together(clients, uplink_kbit, meshes):
    """Seconds that the uplink needs for all that these clients fetch."""
    return _on_uplink(sum(stream_bytes(meshes[client.mesh], len(meshes[client.mesh]) - 1) for client in clients),
                      uplink_kbit)


def own(line, uplink_kbit, levels, figure):
    """Seconds from its start for a client that has the uplink to itself."""
    stream = stream_bytes(levels, packet_of(figure, levels))
    return (2 * _ROUND_TRIPS * line.delay_ms / 1000
            + max(_seconds(stream, line.down_kbit, network.HEADER_BYTES), _on_uplink(stream, uplink_kbit)))


def _shortest_first(jobs):
    """When jobs (release, length) of one machine end if the one with the least left always runs; ascending. At no time
    can more of them have ended by another order."""
    jobs = sorted(jobs)
    waiting, ends, now, index = [], [], 0.0, 0
    while index < len(jobs) or waiting:
        if not waiting:
            now = max(now, jobs[index][0])
        while index < len(jobs) and jobs[index][0] <= now:
            heapq.heappush(waiting, jobs[index][1])
            index += 1
        left = heapq.heappop(waiting)
        until = jobs[index][0] if index < len(jobs) else math.inf
        if now + left <= until:
            now += left
            ends.append(now)
        else:
            heapq.heappush(waiting, left - (until - now))
            now = until
    return ends


def mean(clients, uplink_kbit, meshes, figure):
    """The least mean of the clients' times, and whether the uplink that they share makes it more than the mean of what
    each could have alone. The k-th of them cannot be ready before the k-th when each has the uplink to itself, nor
    before the k-th on an uplink that serves the shortest rest first to lines without limit."""
    lengths = {client: own(client.line, uplink_kbit, meshes[client.mesh], figure) for client in clients}
    alone = sorted(client.arrival + lengths[client] for client in clients)
    jobs = []
    burst = network.burst_bytes(uplink_kbit) * 8 / (uplink_kbit * 1000)
    for client in clients:
        levels = meshes[client.mesh]
        stream = stream_bytes(levels, packet_of(figure, levels))
        wire = stream + math.ceil(stream / network.SEGMENT_BYTES) * (network.HEADER_BYTES + network.ETHERNET_BYTES)
        # The last request is half a round trip before the first byte leaves.
        release = client.arrival + DELAYS_TO_REQUEST * client.line.delay_ms / 1000
        jobs.append((release, wire * 8 / (uplink_kbit * 1000)))
    least_delay = min(client.line.delay_ms for client in clients) / 1000
    # The burst that the uplink lets through at once is there again after each pause, so it is given to each.
    shared = [end + least_delay - burst * (k + 1) for k, end in enumerate(_shortest_first(jobs))]
    least = sum(map(max, alone, shared)) - sum(client.arrival for client in clients)
    separate = sum(lengths.values())
    return least / len(clients), least > 1.001 * separate

-- SPDX-License-Identifier: MIT
-- For wrk: its connections ask for all blobs of one size in turn. Arguments: size, meshes, packets of each. What wrk
-- measured is printed as one line of JSON.
local requests = {}
local at = 0

function init(arguments)
  local size, meshes, packets = arguments[1], tonumber(arguments[2]), tonumber(arguments[3])
  for packet = 0, packets - 1 do
    for mesh = 0, meshes - 1 do
      requests[#requests + 1] = wrk.format("GET", "/" .. size .. "/" .. mesh .. "-" .. packet)
    end
  end
end

function request()
  at = at % #requests + 1
  return requests[at]
end

function done(summary, latency)
  local errors = summary.errors
  io.write(string.format(
    '{"requests":%d,"seconds":%f,"received_bytes":%d,"failed":%d,"latency_us":{"p50":%d,"p90":%d,"p99":%d,"most":%d}}\n',
    summary.requests, summary.duration / 1e6, summary.bytes,
    errors.connect + errors.read + errors.write + errors.status + errors.timeout,
    latency:percentile(50), latency:percentile(90), latency:percentile(99), latency.max))
end

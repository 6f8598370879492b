#!/usr/bin/env bash
# What `covol mark` takes from a browser, requests and messages, under libFuzzer with clang's address and
# undefined-behaviour sanitizers.
#
#   bash tests/fuzz/messages.sh [SECONDS of each, 60]
set -euo pipefail
cd "$(dirname "$0")/../.."

bash tests/install_packages.sh clang
out=build/fuzz_messages
mkdir -p "$out/requests" "$out/messages"
flags=(-std=c++20 -O1 -g1 -Wall -Wextra -fsanitize=fuzzer,address,undefined -fno-sanitize-recover=undefined
  -Ilib/include -Ilib/src -Itools -isystem /usr/include/Imath)
clang++ "${flags[@]}" tests/fuzz/requests.cpp tools/serve/answers.cpp tools/serve/request_rules.cpp tools/serve/secret.cpp \
  -o "$out/requests_fuzzer"
clang++ "${flags[@]}" tests/fuzz/messages.cpp lib/src/study/action_json.cpp -o "$out/messages_fuzzer"
printf '{"key":"a-1","do":"add_mark","structure":1,"kind":"surface","world":[1,2.5,-3e2]}' > "$out/messages/mark"
printf '{"do":"add_outline","structure":1,"axis":2,"at":4,"closed":true,"world":[[1,1,4],[5,1,4],[5,5,4]]}' > "$out/messages/outline"
for what in requests messages; do
  "$out/${what}_fuzzer" "$out/$what" -max_total_time="${1:-60}" -timeout=5 -rss_limit_mb=1024 -print_final_stats=1
done

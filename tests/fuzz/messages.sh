#!/usr/bin/env bash
# Fuzzes the code of `covol mark` that parses requests and messages of a browser, under libFuzzer with clang's address
# and undefined-behaviour sanitizers.
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
printf '{"do":"add_marks","structure":1,"kind":"inside","world":[[1,1,4],[5,1,4]]}' > "$out/messages/marks"
printf '{"do":"add_marks","structure":1,"kind":"surface","world":[],"inside":[[1,1,4]],"outlines":[{"axis":2,"at":4,"closed":true,"world":[[1,1,4],[5,1,4],[5,5,4]]}]}' > "$out/messages/kinds"
printf '{"do":"add_stroke","structure":1,"erases":false,"radius":2.5,"axis":2,"at":4,"world":[[1,1,4],[5,1,4]]}' > "$out/messages/stroke"
printf '{"do":"add_labels","path":"../l.nrrd","digest":"xxh128:0","labels":[{"label":1,"name":"a"}]}' > "$out/messages/labels"
printf '{"do":"set_guess","structure":1,"path":"../m.nrrd","digest":"xxh128:0","label":2}' > "$out/messages/guess"
printf '{"do":"set_options","options":{"voxel_size":0.5,"rho":1,"mark_precision":0.1,"model":"paper"}}' > "$out/messages/options"
printf 'POST /import?as=points\nHost: 127.0.0.1:8000\nOrigin: http://127.0.0.1:8000\nContent-Length: 9\nCookie: covol_mark_8000=fedcba9876543210' > "$out/requests/post"
for what in requests messages; do
  "$out/${what}_fuzzer" "$out/$what" -max_total_time="${1:-60}" -timeout=5 -rss_limit_mb=1024 -print_final_stats=1
done

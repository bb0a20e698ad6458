# A bake that still has cells when the next fault comes, however fast the machine is: a fault that
# takes longer than its share of the cells has them wait (pvsfarm pause) until it is over. Sourced
# after common.sh, by tests that say how their coordinator is asked:
#   farm VERB [OPTIONS]    runs pvsfarm VERB with its endpoint and keys
#   faults=N               how many are to come
# and call begin_holding once the bake is started, next_fault for each, last_fault_over at the end.
share=0     # cells that may be done before the fault is over
happened=0  # faults that came while cells were at workers

look() {  # bake_state: "" if nobody answers; cells_done, cells_leased, taken_back, worker_rows
  local all told
  all=$(farm status --json 2> /dev/null) || all=
  worker_rows=${all#*'"workers":'}
  taken_back=0
  [[ ! $all =~ '"leases_expired":'([0-9]+) ]] || taken_back=$((taken_back + BASH_REMATCH[1]))
  [[ ! $all =~ '"workers_lost":'([0-9]+) ]] || taken_back=$((taken_back + BASH_REMATCH[1]))
  told=${all%%'"counters"'*}  # the workers behind it have cells_done, too
  bake_state= cells_done=0 cells_leased=0
  [[ ! $told =~ '"state":"'([a-z ]+) ]] || bake_state=${BASH_REMATCH[1]}
  [[ ! $told =~ '"cells_done":'([0-9]+) ]] || cells_done=${BASH_REMATCH[1]}
  [[ ! $told =~ '"cells_leased":'([0-9]+) ]] || cells_leased=${BASH_REMATCH[1]}
}
hold() {
  look
  case $bake_state in
    running) [ "$cells_done" -lt "$share" ] || farm pause > /dev/null 2>&1 || true ;;
    paused) [ "$cells_done" -ge "$share" ] || farm resume > /dev/null 2>&1 || true ;;
  esac
}
at_work() { look; [ "$bake_state" = running ] && [ "$cells_leased" -gt 0 ]; }
connected() { look; [[ $worker_rows == *"\"host\":\"$1\""* ]]; }
holds_cells() { at_work && [[ $worker_rows =~ \"host\":\"$1\",[^{}]*\"leases\":[1-9] ]]; }
raise_share() { [ "$share" -ge $((cells_done + $1)) ] || share=$((cells_done + $1)); }
done_more_than() { look; [ "$cells_done" -gt "$1" ]; }

begin_holding() { share=$((cells / (faults + 1))) meanwhile=hold; }

# next_fault TEXT [HOST]: returns at the moment for it: enough is done that faults spread over half
# of the bake, and cells are at workers; at the one on HOST, if that is the victim.
next_fault() {
  local each=$((cells / (faults + 1)))
  share=$(((happened + 1) * each))
  wait_for 900 done_more_than $((happened * each / 2)) || fail "too slow for $1: $cells_done cells"
  [ $# -eq 1 ] || wait_for 180 connected "$2" || fail "$2 did not connect for: $1"
  raise_share $((each / 4))
  if [ $# -eq 1 ]; then
    wait_for 120 at_work || fail "no cells at workers for: $1"
  else
    wait_for 120 holds_cells "$2" || fail "no cells at $2 for: $1"
  fi
  happened=$((happened + 1))
  say "$cells_done of $cells cells done, $cells_leased at workers: $1"
}
# goes_on TEXT: the bake does at least one more cell, in spite of TEXT.
goes_on() {
  look
  raise_share $((cells / (faults + 1) / 4))
  wait_for 120 done_more_than "$cells_done" || fail "the bake did not go on: $1"
}
last_fault_over() { share=$((10 * cells)); hold; }

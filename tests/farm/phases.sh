# What tests/farm.sh checks. Sourced after stack.sh.
num_medium=60  # iterations: so many that there is time to preempt it
num_long=100   # for twenty workers
declare -A hashes=()  # FAMILY -> of the file that an undisturbed worker has made

import_scene() {
  local animation operations=()
  for animation in a b; do
    operations+=("$(lb --json import "drops_$animation" "tests/data/two_drops/${animation^^}" \
      --no-wait | name_of)")
  done
  work_undisturbed
  expect_success "${operations[0]}"
  expect_success "${operations[1]}"
}

# make_expected FAMILY [FLAG ..]: hashes[FAMILY], once
make_expected() {
  [ -z "${hashes[$1]:-}" ] || return 0
  register "$@" >/dev/null
  work_undisturbed
  hashes[$1]=$(hash_of "$1")
}

expect_same() {  # FAMILY OPERATION
  expect_success "$2"
  [ "$(hash_of "$1")" = "${hashes[$1]}" ] || fail "$1 differs from that of an undisturbed worker"
}

# submit PARTITION CPUS [OPTION of sbatch ..]: prints the id of the array
submit() {
  sbatch --parsable --partition "$1" --cpus-per-task "$2" --mem 2000 \
    --output "$scratch/logs/task_%A_%a" "${@:3}" deploy/farm/slurm/workers.sbatch \
    "$PWD/deploy/farm/run-worker.sh" "$scratch/farm.env" --verbose
}

# submit_three PARTITION CPUS [OPTION of sbatch ..]: prints the id of an array of three tasks. The
# first has ended, the others are held. The last one has the id of the array: what it asks of Slurm
# by that id alone is done to all three.
submit_three() {
  local job
  job=$(submit "$1" "$2" --hold --array=1-3 "${@:3}")
  scontrol release "${job}_1"
  await 120 has_ended "${job}_1"
  scontrol hold "${job}_2"
  [ "$(squeue -h -j "${job}_3" -o %A)" = "$job" ] || fail "the last task has not the array's id"
  echo "$job"
}

# Of an array of submit_three, of which the last task has been requeued once: nothing has happened
# to the others.
expect_last_requeued() {  # JOB
  local task restarts
  scontrol release "${1}_2"
  await 180 has_ended "$1"
  expect_tasks_succeeded "$1" 3
  for task in 1 2 3; do
    restarts=$(scontrol -o show job "${1}_$task" | sed -n 's/.* Restarts=\([0-9]*\) .*/\1/p')
    [ "$restarts" = $((task / 3)) ] || fail "task $task was requeued ${restarts:-no} times"
  done
}

has_ended() { [ -z "$(squeue -h -j "$1" 2>/dev/null)" ]; }
is_pending() { [ "$(squeue -h -j "$1" -o %T)" = PENDING ]; }

# Slurm lets a requeued task wait for two minutes.
start_again() {  # JOB [UPDATE ..]
  await 60 is_pending "$1"
  sleep 2  # a start within the second of the requeue has its credential revoked
  scontrol update JobId="$1" StartTime=now "${@:2}"
}

expect_tasks_succeeded() {  # JOB NUM
  local num
  num=$(scontrol -o show job "$1" | grep -c 'JobState=COMPLETED .*ExitCode=0:0') || true
  [ "$num" = "$2" ] || fail "$num of $2 tasks have ended with status 0: $(scontrol show job "$1")"
}

run_array() {
  local k job operations=()
  for k in 1 2 3 4 5 6 7 8; do register "family$k" >/dev/null; done
  work_undisturbed
  for k in 1 2 3 4 5 6 7 8; do hashes[family$k]=$(hash_of "family$k"); done
  for k in 1 2 3 4 5 6 7 8; do operations+=("$(register "family$k")"); done
  local begin=$SECONDS
  job=$(submit farm 1)
  await 1200 has_ended "$job"
  expect_tasks_succeeded "$job" 4
  for k in 1 2 3 4 5 6 7 8; do expect_same "family$k" "${operations[k - 1]}"; done
  echo "eight registrations in $((SECONDS - begin)) s:"
  grep -ho 'drained: .*' "$scratch/logs/task_${job}_"*
}

# lines_of_losses LOG ..: what each attempt has left to the next one, as "ITERATION LOST_S SET_UP_S".
# ITERATION 0: no checkpoint. SET_UP_S: until it was where the one before had been, 0 for the first.
lines_of_losses() {
  /usr/bin/python3 - "$@" <<'PYTHON'
import datetime, re, sys
UNITS = {"h": 3600, "m": 60, "s": 1, "ms": 0.001}
LEFT = re.compile(r"handed back with(?: a checkpoint after iteration (\d+)|.*?);"
                  r" lost is the work of (\S+)")
for name in sys.argv[1:]:
    begin, set_up = None, 0.0
    for line in open(name):
        if ": attempt " in line:
            begin, set_up = datetime.datetime.fromisoformat(line.split()[0]), 0.0
        if ": resumed after " in line:
            time = datetime.datetime.fromisoformat(line.split()[0])
            set_up = (time - begin).total_seconds()
        if left := LEFT.search(line):
            parts = re.findall(r"([\d.]+)(h|ms|m|s)", left.group(2))
            lost = sum(float(number) * UNITS[unit] for number, unit in parts)
            print(left.group(1) or 0, f"{lost:.1f} {set_up:.1f}")
PYTHON
}

expect_small_losses() {  # LOG ..
  lines_of_losses "$@" | awk -v max="$max_lost_s" '
    {++num; with += $1 > 0; sum += $2; if ($2 > worst) worst = $2; set_up += $3; set_ups += $3 > 0}
    END {
      printf "handed back %d times, %d with a checkpoint; lost %.1f s on average, at most %.1f s; ",
        num, with, sum / num, worst
      printf "set up again in %.1f s on average\n", set_ups ? set_up / set_ups : 0
      exit worst > max
    }' || fail "more than $max_lost_s s of work are lost at once"
}

# expect_resumed LOG ITERATION: a task was ended later than ITERATION, and went on where it was
expect_resumed() {
  local left resumed
  left=$(lines_of_losses "$1" | head -n 1 | cut -d' ' -f1)
  resumed=$(sed -n 's/.*resumed after iteration //p' "$1" | head -n 1)
  [ "${left:-0}" -ge "$2" ] || fail "preempted after iteration $2, handed back after ${left:-none}"
  [ "$resumed" = "$left" ] || fail "handed back after iteration $left, resumed after $resumed"
  echo "preempted after iteration $2, handed back and resumed after iteration $left"
}

is_at_iteration() { [ "$(field "$1" 'o["progress"]["iteration"]')" -ge "$2" ]; }

preempt() {  # PARTITION
  local operation job urgent iteration
  make_expected preempted --iterations $num_medium
  job=$(submit_three "$1" 2)
  operation=$(register preempted --iterations $num_medium)
  scontrol release "${job}_3"
  await 120 is_at_iteration "$operation" 5
  iteration=$(field "$operation" 'o["progress"]["iteration"]')
  urgent=$(sbatch --parsable --partition urgent --cpus-per-task 8 --mem 100 \
    --output "$scratch/logs/urgent" --wrap 'sleep 3')
  await 60 has_ended "$urgent"
  start_again "${job}_3"
  await 600 is_done "$operation"
  expect_last_requeued "$job"
  expect_same preempted "$operation"
  expect_resumed "$scratch/logs/task_${job}_3" "$iteration"
  expect_small_losses "$scratch/logs/task_${job}_3"
}

# The registration lasts longer than the task may. When that is requeued, it gets more time.
end_time() {
  local operation job
  make_expected long --iterations $num_long
  job=$(submit_three farm 1 --time=2)
  operation=$(register long --iterations $num_long)
  scontrol release "${job}_3"
  await 240 grep -q 'stopping: --max-time' "$scratch/logs/task_${job}_3"
  start_again "${job}_3" TimeLimit=60
  await 900 is_done "$operation"
  expect_last_requeued "$job"
  expect_same long "$operation"
  expect_resumed "$scratch/logs/task_${job}_3" 1
  expect_small_losses "$scratch/logs/task_${job}_3"
}

# As RQD runs a frame: a shell gets the command and the frame's variables; it ends with SIGKILL.
run_opencue_frames() {
  local command operation frame pids=()
  make_expected family1
  operation=$(register family1)
  command=$(tests/farm/check_templates.py opencue-command .)
  command=${command//\/shared\/liquidblend\/run-worker.sh/$PWD\/deploy\/farm\/run-worker.sh}
  command=${command//\/shared\/liquidblend\/farm.env/$scratch\/farm.env}
  for frame in 1 2; do
    env -i PATH="$PATH" CUE_IFRAME=$frame CUE_THREADS=2 sh -c "$command" \
      >"$scratch/logs/frame$frame" 2>&1 &
    pids+=("$!")
  done
  wait "${pids[0]}" && wait "${pids[1]}" || fail "a frame has failed"
  expect_same family1 "$operation"
  grep -ho 'drained: .*' "$scratch/logs/frame"?
}

# As a session runs a task: the action's words are run without a shell, and get SIGTERM to be cancelled.
run_openjd_tasks() {
  local words operation pid
  make_expected preempted --iterations $num_medium
  operation=$(register preempted --iterations $num_medium)
  eval "words=($(tests/farm/check_templates.py openjd-command . MaxTime=30m \
    RunWorker="$PWD/deploy/farm/run-worker.sh" EnvironmentFile="$scratch/farm.env"))"
  env -i PATH="$PATH" "${words[@]}" >"$scratch/logs/openjd1" 2>&1 &
  pid=$!
  await 120 is_at_iteration "$operation" 5
  kill -TERM $pid
  wait $pid || fail "a cancelled worker has not ended with status 0"
  env -i PATH="$PATH" "${words[@]}" >"$scratch/logs/openjd2" 2>&1 || fail "the second task has failed"
  expect_same preempted "$operation"
  cat "$scratch/logs/openjd1" "$scratch/logs/openjd2" >"$scratch/logs/openjd"
  expect_resumed "$scratch/logs/openjd" 5
}

# One registration, one worker after another: each gets SIGTERM up to a second after the first
# iteration that it has done.
end_twenty_workers() {
  local operation k pid log left=0
  echo "SEED=$seed"
  RANDOM=$seed
  make_expected long --iterations $num_long
  operation=$(register long --iterations $num_long)
  for k in {1..20}; do
    log=$scratch/logs/ended$(printf %02d "$k")
    "$bin/liquidblend-worker" --drain --verbose >"$log" 2>&1 </dev/null &
    pid=$!
    await 300 is_at_iteration "$operation" $((left + 1))
    sleep "0.$((RANDOM % 10))$((RANDOM % 10))"
    kill -TERM $pid
    wait $pid || fail "worker $k has not ended with status 0"
    ! is_done "$operation" || fail "done by $k workers; it needs more iterations"
    left=$(lines_of_losses "$log" | cut -d' ' -f1)
    [ "${left:-0}" -gt 0 ] || fail "worker $k has left no checkpoint"
  done
  work_undisturbed
  expect_same long "$operation"
  expect_small_losses "$scratch"/logs/ended*
  echo "handed back $(field "$operation" 'o["progress"]["handedBack"]') times, says the operation"
}

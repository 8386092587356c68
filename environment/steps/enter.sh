# How a command is started in the environment. Sourced on every call: keep it quick.
# shellcheck shell=bash

# enter WAY ROOT VENV CHECKOUT MPI: set `entered` to the words to put before a command, and the variables it runs with.
enter() {
  local way=$1 root=$2 venv=$3 checkout=$4 mpi=$5
  export GAPBEAM_INSIDE="$suite $project"
  # one thread a rank: the ranks are the parallelism
  export OMP_NUM_THREADS=${OMP_NUM_THREADS:-1} OPENBLAS_NUM_THREADS=${OPENBLAS_NUM_THREADS:-1}
  # Open MPI: as root, on fewer cores than ranks, without binding two runs to the same core
  export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
  case $mpi in
    "") ;;
    [1-4])
      export OMPI_MCA_rmaps_base_oversubscribe=${OMPI_MCA_rmaps_base_oversubscribe:-1}
      export OMPI_MCA_hwloc_base_binding_policy=${OMPI_MCA_hwloc_base_binding_policy:-none}
      ;;
    5)
      export PRTE_MCA_rmaps_default_mapping_policy=${PRTE_MCA_rmaps_default_mapping_policy:-:oversubscribe}
      export PRTE_MCA_hwloc_default_binding_policy=${PRTE_MCA_hwloc_default_binding_policy:-none}
      ;;
    *) export PRTE_MCA_mapby=${PRTE_MCA_mapby:-:oversubscribe} PRTE_MCA_bindto=${PRTE_MCA_bindto:-none} ;;
  esac
  # one machine: shared memory is enough, and TCP only complains where the network is unusual
  export OMPI_MCA_btl=${OMPI_MCA_btl:-^tcp}
  # pictures without a screen
  export PYVISTA_OFF_SCREEN=${PYVISTA_OFF_SCREEN:-true}
  export VTK_DEFAULT_OPENGL_WINDOW=${VTK_DEFAULT_OPENGL_WINDOW:-vtkEGLRenderWindow}
  export VIRTUAL_ENV=$venv

  if [[ -n $root ]]; then
    enter_root "$way" "$root" "$venv" "$checkout"
  else
    export PATH=$here/bin:$venv/bin:$PATH
    export PYTHONPATH=$project:$checkout${PYTHONPATH:+:$PYTHONPATH}
    entered=(env)
  fi
}

# The words that start a command in a root file system: the release's /usr and /etc, this machine's everything else.
enter_root() {
  local way=$1 root=$2 venv=$3 checkout=$4 folder name shared=() overlaid=()
  for name in passwd group hosts resolv.conf localtime pip.conf ssl/certs; do
    [[ -e /etc/$name && -e $root/etc/$name ]] && overlaid+=("/etc/$name")
  done
  for folder in /*; do
    case $folder in
      /bin | /boot | /dev | /etc | /lib* | /lost+found | /proc | /run | /sbin | /sys | /usr) ;;
      *) [[ -d $folder ]] && shared+=("$folder") ;;
    esac
  done
  # folders in use below those left out: a removable disk, /usr/src
  for folder in "$PWD" "$project" "$cache"; do
    case $folder in
      /run/* | /usr/src/* | /boot/* | /dev/shm/*) shared+=("$folder") ;;
    esac
  done
  [[ ! -d /run/media ]] || shared+=(/run/media) # removable disks
  GAPBEAM_SHARED=$(IFS=: && printf '%s' "${shared[*]}") # what is written elsewhere is lost: solver/run/output/results_folder.py
  export GAPBEAM_SHARED
  "enter_with_$way"
  # what points into this machine's own /usr has no meaning there
  entered+=(env)
  for name in PYTHONHOME LD_LIBRARY_PATH LD_PRELOAD CC CXX CONDA_PREFIX; do
    entered+=(-u "$name")
  done
  entered+=("LC_ALL=C.UTF-8" "PATH=$here/bin:$venv/bin:/usr/local/bin:/usr/bin:/bin" "PYTHONPATH=$project:$checkout")
}

# bubblewrap: a mount namespace, which become.sh steps into.
enter_with_root() {
  local folder file
  entered=("$here/steps/become.sh" "$EUID" "$(id -g)"
    --ro-bind "$root/usr" /usr --ro-bind "$root/etc" /etc
    --symlink usr/bin /bin --symlink usr/sbin /sbin --symlink usr/lib /lib --symlink usr/lib64 /lib64
    --dir /run --proc /proc --ro-bind /sys /sys --dev /dev --perms 1777 --tmpfs /dev/shm)
  for file in "${overlaid[@]}"; do
    entered+=(--ro-bind "$(readlink -f "$file")" "$file")
  done
  for folder in "${shared[@]}"; do
    if [[ -L $folder ]]; then
      entered+=(--symlink "$(readlink "$folder")" "$folder")
    else
      entered+=(--bind-try "$folder" "$folder")
    fi
  done
  entered+=(--)
}

# proot: translates paths in the system calls, slower, for containers that allow no namespaces; forward.sh passes signals on.
enter_with_proot() {
  local path
  export PMIX_MCA_gds=hash
  entered=("$here/steps/forward.sh" proot --rootfs="$root" --cwd="$PWD")
  for path in /proc /sys /dev "${overlaid[@]}" "${shared[@]}"; do
    entered+=(--bind="$path")
  done
  entered+=(--)
}

# How a command is started in the environment. Sourced on every call: keep it quick.
# shellcheck shell=bash

# enter WAY ROOT VENV CHECKOUT: set `entered` to the words to put before a command, and the variables it runs with.
enter() {
  local way=$1 root=$2 venv=$3 checkout=$4
  export GAPBEAM_INSIDE=$project
  # one thread a rank: the ranks are the parallelism
  export OMP_NUM_THREADS=${OMP_NUM_THREADS:-1} OPENBLAS_NUM_THREADS=${OPENBLAS_NUM_THREADS:-1}
  # Open MPI: as root, on fewer cores than ranks, without binding two runs to the same core (version 5, then 4)
  export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
  export PRTE_MCA_rmaps_default_mapping_policy=${PRTE_MCA_rmaps_default_mapping_policy:-:oversubscribe}
  export PRTE_MCA_hwloc_default_binding_policy=${PRTE_MCA_hwloc_default_binding_policy:-none}
  export OMPI_MCA_rmaps_base_oversubscribe=${OMPI_MCA_rmaps_base_oversubscribe:-1}
  export OMPI_MCA_hwloc_base_binding_policy=${OMPI_MCA_hwloc_base_binding_policy:-none}
  # pictures without a screen
  export PYVISTA_OFF_SCREEN=${PYVISTA_OFF_SCREEN:-true}
  export VTK_DEFAULT_OPENGL_WINDOW=${VTK_DEFAULT_OPENGL_WINDOW:-vtkEGLRenderWindow}
  export VIRTUAL_ENV=$venv

  if [[ $way == root ]]; then
    enter_root "$root" "$venv" "$checkout"
  else
    export PATH=$here/bin:$venv/bin:$PATH
    export PYTHONPATH=$project:$checkout${PYTHONPATH:+:$PYTHONPATH}
    entered=(env)
  fi
}

# The words that start a command in a root file system: the release's /usr and /etc, this machine's everything else.
enter_root() {
  local root=$1 venv=$2 checkout=$3 folder name
  # one machine: shared memory is enough, and TCP between the ranks only complains in a sandbox
  export OMPI_MCA_btl=${OMPI_MCA_btl:-self,sm}
  export LC_ALL=C.UTF-8
  # Ctrl-C is for the command: bwrap, which waits for it, has to outlive it
  entered=(env --ignore-signal=INT bwrap --die-with-parent
    --ro-bind "$root/usr" /usr --ro-bind "$root/etc" /etc
    --symlink usr/bin /bin --symlink usr/sbin /sbin --symlink usr/lib /lib --symlink usr/lib64 /lib64
    --dir /run --proc /proc --ro-bind /sys /sys --dev /dev --perms 1777 --tmpfs /dev/shm)
  for name in passwd group hosts resolv.conf localtime pip.conf ssl/certs; do
    [[ -e /etc/$name && -e $root/etc/$name ]] && entered+=(--ro-bind "$(readlink -f "/etc/$name")" "/etc/$name")
  done
  for folder in /*; do
    case $folder in
      /bin | /boot | /dev | /etc | /lib* | /lost+found | /proc | /run | /sbin | /sys | /usr) ;;
      *)
        if [[ -L $folder ]]; then
          entered+=(--symlink "$(readlink "$folder")" "$folder")
        elif [[ -d $folder ]]; then
          entered+=(--bind-try "$folder" "$folder")
        fi
        ;;
    esac
  done
  # folders in use below those left out: a removable disk, /usr/src
  for folder in "$PWD" "$project" "$cache"; do
    case $folder in
      /run/* | /usr/src/*) entered+=(--bind "$folder" "$folder") ;;
    esac
  done
  # what points into this machine's own /usr has no meaning there
  for name in PYTHONHOME LD_LIBRARY_PATH LD_PRELOAD CC CXX CONDA_PREFIX; do
    entered+=(--unsetenv "$name")
  done
  entered+=(--setenv PATH "$here/bin:$venv/bin:/usr/local/bin:/usr/bin:/bin"
    --setenv PYTHONPATH "$project:$checkout" --chdir "$PWD" -- env --default-signal=INT)
}

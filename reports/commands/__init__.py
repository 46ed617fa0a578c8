"""The commands of `iapb`, one file each; heavy imports wait inside the functions, so that --help is instant."""
